"""A learned flow, its network, its training scenes and its study."""

"""What a built site is held to, and the browsers that it is read with."""

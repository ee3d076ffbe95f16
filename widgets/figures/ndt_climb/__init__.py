"""The figure `ndt-climb`: climbing the NDT score."""

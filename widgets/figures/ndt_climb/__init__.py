"""The figure `ndt-climb`: the climb on the NDT score."""

"""The figure `contestants`: what each contestant links one source point to, at one pose."""

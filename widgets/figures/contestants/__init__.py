"""The figure `contestants`: what each contestant makes of one pose."""

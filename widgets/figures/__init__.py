"""The figures of the site, one module each."""

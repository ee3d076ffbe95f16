"""Distribution methods: maximum mean discrepancy, its derivative, and maps of objectives over translations."""

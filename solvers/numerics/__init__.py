"""Numerical tools shared by methods: kernels, features, filters, robust weights, Newton and Gauss-Newton steps."""

"""What several methods compute with: kernels, features, filters, robust weights, Newton and Gauss-Newton steps."""

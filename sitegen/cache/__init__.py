"""The cache between builds, keyed by hashes of inputs, and the worker processes that fill it in advance."""

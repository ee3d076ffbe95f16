"""Python for the page: Pyodide, numpy and our wheel, trimmed, compiled and packed."""

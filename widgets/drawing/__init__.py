"""Pictures: marks in world units, charts built from them, and their rendering to SVG."""

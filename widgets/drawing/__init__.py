"""Pictures: marks in world units, charts of them, and the SVG that they become."""

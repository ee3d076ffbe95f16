"""The figure `spread`: one place scanned again and again."""

"""The figure `atlas`: where runs from every start end."""

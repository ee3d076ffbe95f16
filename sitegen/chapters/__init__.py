"""What authors write, read and checked: chapters, slides, terms, references, claims, and where figures are placed."""

"""What the project is measured by, and how the table of it is written."""

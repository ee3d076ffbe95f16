"""The pages' assets: style sheet, script, typefaces, icons, colours, and files for hosts."""

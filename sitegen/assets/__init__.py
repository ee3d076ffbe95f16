"""What pages load beside their text: style sheet, script, typefaces, icons, colours, and what hosts are told."""

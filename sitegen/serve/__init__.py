"""The site while it is written: built anew at every edit, and told to the open page."""

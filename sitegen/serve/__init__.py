"""The live preview for authors: rebuilds the site on every edit and updates open pages."""

"""The build pipeline, from reading the content to publishing the site."""

"""The site's pages: chapters, slides, notebooks, the API reference, the search index."""

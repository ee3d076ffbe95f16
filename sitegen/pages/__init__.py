"""Pages written from chapters: chapters, slides, notebooks, the reference, the search."""

"""The checks of a built site, and the browsers that tests and checks drive."""

"""The site generator: reads content, bakes figures, assembles the browser runtime, writes and checks the pages."""

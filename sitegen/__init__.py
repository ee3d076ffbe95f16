"""The generator: reads content, bakes figures, assembles the browser runtime, writes the pages, checks the result."""

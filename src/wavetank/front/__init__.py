"""Ways to watch a world and to lay hands on it: files without a screen, a page in a browser, a notebook."""

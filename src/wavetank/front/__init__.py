"""Ways to watch a world: headless files now, window and browser later."""

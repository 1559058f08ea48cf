"""A headless Chromium, and what a viewer of the page of `wavetank play` gets in it."""

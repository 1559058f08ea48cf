"""The interface: a page in a browser, the notebook's widget, a window; and what they share."""

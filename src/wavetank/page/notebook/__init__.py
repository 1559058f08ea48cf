"""The water in a cell of a notebook."""

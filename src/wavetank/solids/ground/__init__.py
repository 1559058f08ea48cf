"""Ground: outlines in the plane, and heights."""

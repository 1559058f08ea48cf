"""The film path: a path tracer over the same water, solids, sky and floor that the other pictures show."""

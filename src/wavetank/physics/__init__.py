"""The method: `step.py` is Algorithm 1, every other file is one of its lines."""

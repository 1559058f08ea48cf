"""A running world, one instant of it, and its snapshots."""

"""A world as data: tank, fluids, solids, forces, goals, and the bundled scenes."""

"""Solids from meshes: files, triangles, and the grids of distances that they become."""

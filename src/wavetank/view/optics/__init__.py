"""Functions of rays, light and water that passes share, for kernels."""

"""The kernels of forces beside gravity; their numbers are data of a scene (`scene/forces`)."""

"""Pictures of a world, computed by kernels: camera, passes, colours, legend."""

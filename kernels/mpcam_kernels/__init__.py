"""Dr.Jit kernels on arrays and functions; they know no camera class, no file and no JAX."""

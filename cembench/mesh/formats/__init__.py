"""The formats of mesh files: one module reads and writes each."""

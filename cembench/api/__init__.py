"""The functions behind the public API and the commands: map, benchmark, morph, theory, ..."""

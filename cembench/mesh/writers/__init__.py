"""One mesh format a file: a surface, with texture coordinates where it has them, to bytes."""

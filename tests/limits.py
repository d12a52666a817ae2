"""A disk on which little fits, made from the limit that the system sets on the size of a file."""

import resource
from contextlib import contextmanager


@contextmanager
def files_of_at_most(size):
    """Let no file grow beyond `size` bytes, in this process and in those that it starts."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def tree(folder):
    """Every path below a folder, with what is there: content, target of a link, or None."""

    def content(path):
        if path.is_symlink():
            return str(path.readlink())
        return path.read_bytes() if path.is_file() else None

    return {path.relative_to(folder): content(path) for path in sorted(folder.rglob("*"))}

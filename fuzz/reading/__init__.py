"""Slow, obvious readers of mesh files, written from the formats' specifications alone.

They share nothing with the readers of the package: no library for meshes, no numpy. Where a file
breaks its specification they raise :class:`Damaged`; where the specification says nothing they are
lenient, and each leniency is named in the reader's docstring.
"""

from fuzz.reading.content import Content, Damaged
from fuzz.reading.mat import read_mat
from fuzz.reading.obj import read_obj
from fuzz.reading.off import read_off
from fuzz.reading.ply import read_ply
from fuzz.reading.stl import read_stl

__all__ = ["READERS", "Content", "Damaged"]

#: By the suffix of the file's name.
READERS = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
    ".mat": read_mat,
}

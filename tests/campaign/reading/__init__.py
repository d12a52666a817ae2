"""Slow, obvious readers of mesh files, written from the formats' specifications alone.

They share nothing with the readers of the package: no library for meshes, no numpy. Where a file
breaks its specification they raise :class:`Damaged`; where the specification says nothing they are
lenient, and each leniency is named in the reader's docstring.
"""

from tests.campaign.reading.content import Content, Damaged
from tests.campaign.reading.mat import read_mat
from tests.campaign.reading.obj import read_obj
from tests.campaign.reading.off import read_off
from tests.campaign.reading.ply import read_ply
from tests.campaign.reading.stl import read_stl

__all__ = ["READERS", "Content", "Damaged"]

#: By the suffix of the file's name.
READERS = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
    ".mat": read_mat,
}

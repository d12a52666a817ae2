"""Where texture coordinates lie; apart, because the command line's help needs nothing else."""

from __future__ import annotations

from enum import StrEnum


class Place(StrEnum):
    """Where texture coordinates lie: in the unit square, or as the algorithm has them."""

    unit = "unit"
    disk = "disk"

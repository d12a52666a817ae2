"""Placement of texture coordinates, in its own module so that the command line loads quickly."""

from __future__ import annotations

from enum import StrEnum


class Place(StrEnum):
    """Placement of texture coordinates: in the unit square, or as in the map."""

    unit = "unit"
    disk = "disk"

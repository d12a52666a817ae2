"""Notices: what the user should know about a mesh or map that is not an error.

Each has a kind, for programs, and a text, for people. Code decides on the kind alone, so texts can
be reworded.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class NoticeKind(StrEnum):
    """The subject of a notice."""

    # About a file or a mesh.
    #: Lines that the file format does not define were ignored.
    LINES_IGNORED = "lines_ignored"
    POLYGONS_CUT = "polygons_cut"
    #: Two arrays of a file were used as vertices and triangles, because they fit.
    ARRAYS_GUESSED = "arrays_guessed"
    #: Vertices in no triangle were left out.
    ISOLATED_LEFT_OUT = "isolated_left_out"
    #: The steps of the coordinates are as large as the edges.
    COARSE_COORDINATES = "coarse_coordinates"
    #: Positions in degrees, heights in metres.
    MIXED_UNITS = "mixed_units"
    #: Two sheets of the surface nearly coincide.
    NEAR_SHEETS = "near_sheets"
    #: Boundaries lie a tiny distance apart.
    GAPS = "gaps"
    #: The mesh was repaired on request.
    REPAIRED = "repaired"
    CUT_OPEN = "cut_open"
    ORIENTATION_REPAIRED = "orientation_repaired"
    #: Triangles are so thin that their cotangents lose digits.
    SLIVERS = "slivers"
    #: The mesh is not well-conditioned in the sense of the paper's Definition 1.
    DEFINITION_1 = "definition_1"
    #: The surface was remeshed without its generator's preferred filter.
    REMESHED_WITHOUT_FILTER = "remeshed_without_filter"

    # About a map or its measurement.
    IMAGE_OVERLAPS = "image_overlaps"
    #: Only in records made before this was a fault.
    HOLES_NOT_CIRCULAR = "holes_not_circular"
    #: A metric is not finite, or is dominated by rounding.
    LOST_IN_ROUNDING = "lost_in_rounding"
    #: Triangles fold in the file, which holds fewer digits than the map needs.
    FOLDED_BY_ROUNDING = "folded_by_rounding"
    #: The iteration ended early, because the boundary is too crowded for it.
    CROWDED_BOUNDARY = "crowded_boundary"
    #: The method's own map was not valid, and its last resort made another one.
    LAST_RESORT = "last_resort"
    FAR_FROM_CONFORMAL = "far_from_conformal"
    #: Other parameters, which the algorithm suggested, give much smaller angle errors.
    BETTER_PARAMETERS = "better_parameters"
    #: Timed calls returned a different result than the checked call.
    NOT_DETERMINISTIC = "not_deterministic"
    #: E_C of the timed maps is more than 1 % above that of the checked one.
    WORSE_WHEN_TIMED = "worse_when_timed"
    PROCESSES_LEFT = "processes_left"
    #: The first call of a process took much longer than the later ones.
    COLD_FIRST_CALL = "cold_first_call"
    #: A process shared with the cells that a cell is compared with could not be used.
    NOT_TOGETHER = "not_together"
    #: How the seconds of an external program were measured.
    PROGRAM_SECONDS = "program_seconds"

    #: Anything else, e.g. from records without kinds.
    OTHER = "other"


@dataclass(frozen=True)
class Notice:
    """A notice with its kind; ``str`` gives its text."""

    kind: NoticeKind
    text: str

    def __str__(self) -> str:
        return self.text


def of_kind(kind: NoticeKind, notices: Iterable[Notice]) -> tuple[Notice, ...]:
    """Return the notices of one kind, in order."""
    return tuple(notice for notice in notices if notice.kind is kind)

"""What the user should know of a mesh or a map that is no fault: a kind for programs, a text.

Whoever decides something decides on the kind; the texts are free to be reworded.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class NoticeKind(StrEnum):
    """What a notice is about."""

    # Of a file, or of a mesh.
    #: Lines of a file that its format does not know were ignored.
    LINES_IGNORED = "lines_ignored"
    POLYGONS_CUT = "polygons_cut"
    #: Two arrays of a file were taken for vertices and triangles, because they fit.
    ARRAYS_GUESSED = "arrays_guessed"
    #: Something was mended on request.
    REPAIRED = "repaired"
    CUT_OPEN = "cut_open"
    ORIENTATION_REPAIRED = "orientation_repaired"
    #: Triangles so thin that cotangents lose digits.
    SLIVERS = "slivers"
    #: The mesh is not well-conditioned in the sense of the paper's Definition 1.
    DEFINITION_1 = "definition_1"
    #: A surface was remeshed without the filter that its generator prefers.
    REMESHED_WITHOUT_FILTER = "remeshed_without_filter"

    # Of a map, or of its measurement.
    IMAGE_OVERLAPS = "image_overlaps"
    HOLES_NOT_CIRCULAR = "holes_not_circular"
    #: A figure is not finite, or only rounding can have made it.
    LOST_IN_ROUNDING = "lost_in_rounding"
    #: Triangles fold in a file, because it holds fewer digits than the map needs.
    FOLDED_BY_ROUNDING = "folded_by_rounding"
    #: The iteration ended early, because the boundary is too crowded for it.
    CROWDED_BOUNDARY = "crowded_boundary"
    FAR_FROM_CONFORMAL = "far_from_conformal"
    #: Timed calls returned other bits than the checked one.
    NOT_DETERMINISTIC = "not_deterministic"
    PROCESSES_LEFT = "processes_left"
    #: The first call of a process took far longer than the later ones.
    COLD_FIRST_CALL = "cold_first_call"
    #: What is to be known of the seconds of an external program.
    PROGRAM_SECONDS = "program_seconds"

    #: Anything else, as in records that hold no kinds.
    OTHER = "other"


@dataclass(frozen=True)
class Notice:
    """A notice; printing it prints its text."""

    kind: NoticeKind
    text: str

    def __str__(self) -> str:
        return self.text


def of_kind(kind: NoticeKind, notices: Iterable[Notice]) -> tuple[Notice, ...]:
    """Return the notices of one kind, in order."""
    return tuple(notice for notice in notices if notice.kind is kind)


def notice_of_old(text: str) -> Notice:
    """Return the notice that a file holds as a plain text, as all did before there were kinds.

    This is the one place that looks at the wording of a message, and only at wording of that time.
    """
    breaks_definition_1 = text.startswith("Definition 1")
    return Notice(NoticeKind.DEFINITION_1 if breaks_definition_1 else NoticeKind.OTHER, text)

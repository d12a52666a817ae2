"""The colour, marker and dash of each algorithm, the same in every plot of every report.

The colours are those of Okabe and Ito, which the colour-blind can distinguish; markers and dashes
distinguish them in print without colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class SeriesStyle:
    """A colour, and a marker and a dash, each as named by matplotlib and by Plotly."""

    colour: str
    marker: tuple[str, str] = ("o", "circle")
    dash: tuple[str, str] = ("-", "solid")


_KNOWN = {
    "cem": SeriesStyle("#0072B2", ("o", "circle"), ("-", "solid")),
    "qiem": SeriesStyle("#D55E00", ("s", "square"), ("--", "dash")),
    "fdm": SeriesStyle("#009E73", ("^", "triangle-up"), ("-.", "dashdot")),
    "ldm": SeriesStyle("#CC79A7", ("D", "diamond"), (":", "dot")),
    "harmonic-circle": SeriesStyle("#E69F00", ("v", "triangle-down"), ("--", "longdash")),
    "lscm": SeriesStyle("#56B4E9", ("P", "cross"), ("-.", "longdashdot")),
}
_COLOURS = ("#7f5f00", "#4d4d4d", "#8c564b", "#5f6b9a", "#3b7d7d", "#a0405f")
_MARKERS = (
    ("X", "x"), ("<", "triangle-left"), (">", "triangle-right"), ("p", "pentagon"),
    ("h", "hexagon"), ("*", "star"),
)  # fmt: skip
_DASHES = (("-", "solid"), ("--", "dash"), (":", "dot"), ("-.", "dashdot"))


def _another(k: int) -> SeriesStyle:
    """Return the style of the k-th algorithm that has none of its own.

    After every six the markers and dashes move on by one, so 24 styles are different.
    """
    turn = k // len(_COLOURS)
    return SeriesStyle(
        _COLOURS[k % len(_COLOURS)],
        _MARKERS[(k + turn) % len(_MARKERS)],
        _DASHES[(k % len(_COLOURS) + turn) % len(_DASHES)],
    )


#: Style of series that are not algorithms: bounds, fits, the paper's own figures.
PLAIN = SeriesStyle("#6b7683", ("o", "circle"), (":", "dot"))
#: Colours for the phases of a call and for the remainder: paler than those of algorithms and
#: different from them, because both occur in one legend.
PARTS = (
    "#77aadd", "#ee8866", "#44bb99", "#eedd88", "#ffaabb", "#bbcc33", "#99ddff", "#c2a5cf",
    "#d9b48f", "#aaaa00", "#8da0cb", "#a9c7b4", "#e78ac3", "#66c2a5", "#b07d62", "#7fa1c4",
    "#d5c1e8", "#f2c14e",
)  # fmt: skip
REST = "#b3b9c0"


def series_styles(names: Sequence[str]) -> dict[str, SeriesStyle]:
    """Return a style for each name: fixed for known algorithms, others in turn."""
    others = [name for name in dict.fromkeys(names) if name not in _KNOWN]
    return _KNOWN | {name: _another(k) for k, name in enumerate(others)}


#: Phases with a colour of their own, the same in every plot.
_PHASES = (
    "solves", "factorisation", "assembly", "laplacian", "ordering", "symbolic", "boundary",
    "beltrami", "boundary step", "folds", "energy", "start", "patches", "condensation",
    "dense factorisation", "schur complement", "gauge", "process",
)  # fmt: skip


def phase_style(phase: str) -> SeriesStyle:
    """Return the colour of a phase; the remainder and phases of plug-ins are grey."""
    return SeriesStyle(PARTS[_PHASES.index(phase)] if phase in _PHASES else REST)

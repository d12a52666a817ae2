"""The columns of a run's frame: each figure of a record is named, read and worded here, once.

Rows, exports, tables and plots take their columns from here. A column for all of them is added here
and nowhere else; a metric is added in :mod:`cembench.conformal.metrics`, and is a column with that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from cembench.conformal.atlas import ATLAS_METRICS
from cembench.conformal.metrics import METRICS, Metric
from cembench.core.notices import NoticeKind, of_kind
from cembench.results.comparison import (
    Comparison,
    compare,
    compare_cpu,
    is_unstable,
    paired_ratios,
    reference_of,
    references,
    seconds_interval,
    speedup_columns,
)
from cembench.results.multiple_testing import corrected
from cembench.results.records import REFERENCE, LinearAlgebraWork, Record

#: Marks of algorithms that are not cembench's code, in tables.
MARKS: Mapping[str, str] = {"program": "†", "library": "‡", "maps": "§"}
_OTHERS = {
    "program": "external program: its seconds are the wall clock of a process, with its start and "
    "its files; comparisons take its solve time, and a verdict needs the wall clock less its start "
    "to agree with the time that it prints",
    "library": "a library of others, called in the process: it solves its systems in its own way",
    "maps": "maps that somebody made, read from files: they have no seconds, memory or iterations",
}


def mark_of(record: Record) -> str:
    """Return the mark of an algorithm in a table; "" for cembench's own and plug-ins."""
    return "" if record.external is None else MARKS[record.external.kind]


def marks_explained(records: list[Record]) -> list[str]:
    """Return one line for each mark used in a table of these records."""
    kinds = {record.external.kind for record in records if record.external is not None}
    return [f"{MARKS[kind]} {words}" for kind, words in _OTHERS.items() if kind in kinds]


def solve_words(record: Record) -> str:
    """Return the origin of a program's solve time."""
    return (
        "printed by the program"
        if record.outcome.own_seconds is not None
        else "wall clock less start"
    )


def seconds_words(record: Record) -> str:
    """Return the times of an external program in one line; "" for anything else."""
    outcome = record.outcome
    if not record.is_program or outcome.median_seconds is None:
        return ""
    parts = [f"wall clock of the process {outcome.median_seconds:.3f} s"]
    start, solve = outcome.start_seconds, outcome.solve_seconds
    parts.append("start unknown" if start is None else f"on a small mesh {start:.3f} s")
    if solve is not None:
        parts.append(f"solve {solve:.3f} s ({solve_words(record)})")
    if outcome.program is not None:
        sizes = outcome.program.input_bytes, outcome.program.output_bytes
        parts.append("files {:,.0f} kB in, {:,.0f} kB out".format(*(s / 1000 for s in sizes)))
        if outcome.program.version:
            parts.append(f"version: {outcome.program.version}")
    return "; ".join(parts)


MIB, MILLION = 2**20, 1e6
#: The metrics of maps, those of atlases last.
FIGURES = (*METRICS, *ATLAS_METRICS)
_ENERGY = next(metric for metric in METRICS if metric.name == "conformal_energy")


def significant(number: float, digits: int = 3) -> str:
    """Return a number with this many significant digits, without an exponent if possible."""
    if number == 0 or not 1e-5 <= abs(number) < 10**6:
        return f"{number:.{digits}g}"
    whole = len(f"{abs(number):.0f}") if abs(number) >= 1 else 0
    if whole >= digits:
        return f"{number:,.0f}"
    leading = 0
    while whole == 0 and abs(number) < 10 ** -(leading + 1):
        leading += 1
    return f"{number:.{digits - whole + leading}f}"


@dataclass(frozen=True)
class FrameColumn:
    """A column of the frame.

    Parameters
    ----------
    name : str
        Name in rows, exports and declarations.
    of : function of a record
        Its value; None where there is none.
    heading, unit : str
        How a table heads it.
    form : str
        Format of a number, "significant" for three significant digits, "tenths", or "percent".
    lacking : str or function of a record
        Why a record that ended ok has no value.
    timed : bool
        Whether it is a time: marked if unstable, and with the letter of its machine.
    """

    name: str
    of: Callable[[Record], Any]
    heading: str = ""
    unit: str = ""
    form: str = "g"
    lacking: str | Callable[[Record], str] = "not measured"
    timed: bool = False

    def why_lacking(self, record: Record) -> str:
        """Return why a record that ended ok has no value."""
        if self.name in record.outcome.metrics:
            return "infinite"
        return self.lacking if isinstance(self.lacking, str) else self.lacking(record)

    def text(self, number: float) -> str:
        """Return a number as a table has it."""
        return worded(number, self.form)


def worded(number: float, form: str) -> str:
    """Return a number in the form of a :class:`FrameColumn`."""
    if form == "significant":
        return significant(number)
    if form == "tenths":
        return f"{round(number, 1):g}"
    if form == "percent":
        return f"{100 * number:.0f} %"
    return format(int(number) if form.endswith("d") else number, form)


def _at(path: str) -> Callable[[Record], Any]:
    """Return a function that reads a dotted path of a record; None where a part of it is None."""
    names = path.split(".")

    def of(record: Record) -> Any:
        value: Any = record
        for name in names:
            value = None if value is None else getattr(value, name)
        return value

    return of


#: Targets whose images have a size of their own.
_FIXED = ("disk", "circular holes")


def is_free(target: str) -> bool:
    """Whether a target leaves the size of the image free.

    >>> is_free("free boundary"), is_free("disk")
    (True, False)
    """
    return target not in _FIXED


def comparable_energy(record: Record) -> float | None:
    """Return E_C, over the image's area where the target leaves its size free."""
    if is_free(record.target):
        return record.outcome.relative_energy
    return record.outcome.metrics.get(_ENERGY.name)


def _metric(metric: Metric) -> FrameColumn:
    def of(record: Record) -> Any:
        return record.outcome.metrics.get(metric.name)

    return FrameColumn(
        metric.name, of, metric.heading, metric.unit, metric.form, _without(metric.name)
    )


def _without(name: str) -> str | Callable[[Record], str]:
    """Return why a map has no such metric: it is of another kind, or the record is older."""
    if name != "common_gauge_energy":
        return "not measured"
    return lambda record: (
        "the map does not go to the disk"
        if record.target in ("free boundary", "atlas")
        else "not measured"
    )


def _unmeasured(record: Record) -> str:
    return "the map was read from a file" if record.is_given else "not measured"


def _uncounted(record: Record) -> str:
    return "the library does not report it" if counted(record) else "not counted"


def _end(record: Record, which: str) -> float | None:
    interval = seconds_interval(record)
    return None if interval is None else float(getattr(interval, which))


def _solve_from(record: Record) -> str | None:
    has = record.is_program and record.outcome.solve_seconds
    return solve_words(record) if has else None


def family_of(record: Record) -> str:
    """Return the object that a record's surface shows; if unknown, the surface's own name."""
    return record.mesh.family or record.cell.mesh


#: Figures to which stand-ins are fitted.
FITTED = ("conformal_energy", "angle_error_mean_deg", "angle_error_sd_deg")


def is_fitted(record: Record) -> bool:
    """Whether a record's :data:`FITTED` figures are of the fit itself, and so decide nothing."""
    return record.mesh.fitted == record.cell.algorithm


def half_width(record: Record) -> float | None:
    """Return half the width of the 95 % interval of a cell's seconds, in percent of them."""
    interval, seconds = seconds_interval(record), record.outcome.median_seconds
    return 50 * (interval.high - interval.low) / seconds if interval and seconds else None


def counted(record: Record) -> LinearAlgebraWork | None:
    """Return the linear algebra that was counted in a cell's call; None if none was."""
    work = record.outcome.work
    return work if work is not None and work.numeric else None


def _in(scale: float, name: str) -> Callable[[Record], float | None]:
    def of(record: Record) -> float | None:
        work = counted(record)
        amount = getattr(work, name) if work else None
        return amount / scale if amount else None

    return of


def _memory(record: Record) -> float | None:
    increase = record.outcome.memory_increase_bytes
    return None if increase is None else increase / MIB


_SECONDS: Mapping[str, Any] = {"unit": "s", "form": "significant"}
_PROGRAM = "only external programs have it, if they are measured"
_C = FrameColumn

#: What rows and exports have, in this order, the metrics among it.
EXPORTED = (
    _C("mesh", _at("cell.mesh"), "surface"),
    _C("algorithm", _at("cell.algorithm"), "algorithm"),
    _C("title", _at("title"), "algorithm"),
    _C("target", _at("target"), "target"),
    _C("external", _at("external.kind")),
    _C("external_name", _at("external.name")),
    _C("external_version", _at("outcome.program.version")),
    _C("parameters", _at("cell.parameters")),
    _C("status", _at("outcome.status"), "status"),
    _C("cause", _at("outcome.cause"), "cause"),
    *map(_metric, FIGURES),
    _C(
        "folded_before_repair", _at("outcome.folded_before_repair"), "folds before",
        form=",.0f", lacking="not counted by the algorithm",
    ),
    _C("boundaries", lambda r: [b.model_dump() for b in r.outcome.boundaries]),
    _C(
        "iterations", _at("outcome.iterations"), "iterations",
        form="d", lacking=_unmeasured,
    ),
    _C(
        "seconds", _at("outcome.median_seconds"), "seconds",
        lacking=_unmeasured, timed=True, **_SECONDS,
    ),
    _C("seconds_raw", lambda r: list(r.outcome.seconds)),
    _C(
        "seconds_together", lambda r: [x.together_seconds for x in r.outcome.rounds if x.together]
    ),
    _C("seconds_kernel", lambda r: [x.kernel_seconds for x in r.outcome.rounds]),
    _C("seconds_low", lambda r: _end(r, "low")),
    _C("seconds_high", lambda r: _end(r, "high")),
    _C("seconds_min", lambda r: min((min(x.calls) for x in r.outcome.rounds), default=None)),
    _C("seconds_calls", lambda r: [list(x.calls) for x in r.outcome.rounds]),
    _C("unstable", is_unstable),
    _C("ended", _at("outcome.ended")),
    _C("cpu_seconds", _at("outcome.cpu_seconds"), "CPU", **_SECONDS),
    _C("busy_rounds", lambda r: sum(x.busy for x in r.outcome.rounds)),
    _C("start_seconds", _at("outcome.start_seconds"), "start", lacking=_PROGRAM, **_SECONDS),
    _C("own_seconds", _at("outcome.own_seconds")),
    _C(
        "solve_seconds",
        lambda r: r.outcome.solve_seconds if r.is_program else None,
        "solve", lacking=_PROGRAM, **_SECONDS,
    ),
    _C("input_bytes", _at("outcome.program.input_bytes")),
    _C("output_bytes", _at("outcome.program.output_bytes")),
    _C("phases", _at("outcome.phases")),
    _C("factorisations", _at("outcome.work.numeric")),
    _C("analyses", _at("outcome.work.symbolic")),
    _C("right_hand_sides", _at("outcome.work.right_hand_sides")),
    _C("matrix_order", _at("outcome.work.order")),
    _C("factor_entries", _at("outcome.work.entries")),
    _C("peak_memory_bytes", _at("outcome.peak_memory_bytes")),
    _C("memory_increase_bytes", _at("outcome.memory_increase_bytes")),
    _C("notes", lambda r: [str(note) for note in r.outcome.notes]),
    _C("energy_history", lambda r: list(r.outcome.energy_history)),
    _C("extras", _at("outcome.extras")),
    _C("vertices", _at("mesh.vertices"), "vertices", form=",.0f"),
    _C("faces", _at("mesh.faces"), "faces", form=",.0f"),
    _C("boundary_vertices", _at("mesh.boundary_vertices"), "boundary vertices", form=",.0f"),
    _C("non_delaunay_share", _at("mesh.non_delaunay_share"), "not Delaunay", form=".1%"),
    _C("notices", lambda r: [str(notice) for notice in r.mesh.notices]),
    _C("origin", _at("mesh.origin")),
    _C("paper_row", lambda r: r.mesh.paper_row or None),
    _C("fitted", is_fitted),
    _C("source", lambda r: r.mesh.source or None),
    _C("family", family_of),
    _C("solves", _at("cell.solves"), "solves"),
    _C("backend", _at("cell.backend")),
    _C("threads", _at("cell.threads")),
    _C("mesh_hash", _at("cell.mesh_hash")),
    _C("repeats", lambda r: r.cell.repeats or None),
    _C("precision", _at("cell.precision")),
    _C("rounds", lambda r: len(r.outcome.rounds), "rounds", form="d"),
    _C("environment", _at("environment")),
    _C("started_at", _at("started_at")),
    _C("key", _at("cell.key")),
)  # fmt: skip
#: What is derived of it for tables.
DERIVED = (
    _C("relative_energy", _at("outcome.relative_energy"), "E_C / A", form=".4f"),
    _C("comparable_energy", comparable_energy, "E_C", form=_ENERGY.form),
    _C("half_width", half_width, "±%", form=".0f", lacking="fewer than six rounds"),
    _C("memory_mib", _memory, "memory", "MiB", ",.0f", _unmeasured),
    _C(
        "call_seconds", lambda r: None if r.is_program else r.outcome.median_seconds, "call",
        lacking="an external program is a process, not a call", **_SECONDS,
    ),
    _C(
        "wall_seconds", lambda r: r.outcome.median_seconds if r.is_program else None, "wall",
        lacking=_PROGRAM, **_SECONDS,
    ),
    _C(
        "counted_factorisations", _in(1, "numeric"), "factored",
        form=".0f", lacking="not counted",
    ),
    _C(
        "counted_columns", _in(1, "right_hand_sides"), "solved",
        form="tenths", lacking="not counted",
    ),
    _C("factor_millions", _in(MILLION, "entries"), "factor, M", form=".3g", lacking=_uncounted),
    _C("solve_from", _solve_from, "solve from"),
    _C("definition_1", lambda r: of_kind(NoticeKind.DEFINITION_1, r.mesh.notices)),
    _C("faults", lambda r: sorted({fault.kind.value for fault in r.outcome.faults})),
)  # fmt: skip
#: All columns by name.
COLUMNS: Mapping[str, FrameColumn] = MappingProxyType(
    {column.name: column for column in (*EXPORTED, *DERIVED)}
)


_METRICS = frozenset(metric.name for metric in FIGURES)


def rows(records: Sequence[Record], reference: str = REFERENCE) -> list[dict[str, Any]]:
    """Return all records of a run as flat rows, each compared with the reference on its surface.

    `verdict` is for each comparison alone; `verdict_corrected` is corrected for all rows (Holm),
    and so is `p`. `ratios` are those to the reference's seconds that decide, one for each round.
    """
    compared = against_reference(records, reference)
    together = corrected([one for _, one in compared])
    made = []
    for record, (base, one), both in zip(records, compared, together, strict=True):
        cpu = compare_cpu(record, base) if base is not None and one is not None else None
        ratios = paired_ratios(record, base) if base is not None and one is not None else []
        made.append(row(record) | _compared(base, one, both, cpu) | {"ratios": ratios})
    return made


def against_reference(
    records: Sequence[Record], reference: str = REFERENCE
) -> list[tuple[Record | None, Comparison | None]]:
    """Return the reference and the comparison for each record; None if there is none."""
    known = references(records, reference)
    pairs: list[tuple[Record | None, Comparison | None]] = []
    for record in records:
        base = reference_of(record, known)
        other = base is not None and base.cell.algorithm != record.cell.algorithm
        pairs.append((base, compare(record, base) if other and base is not None else None))
    return pairs


def _compared(
    reference: Record | None,
    found: Comparison | None,
    together: Comparison | None,
    cpu: Comparison | None,
) -> dict[str, Any]:
    """Return the columns of the speedup of the reference and its verdicts."""
    interval = cpu and cpu.interval
    return {
        "reference": reference.cell.algorithm if found and reference else None,
        **speedup_columns(found),
        "verdict_corrected": together and together.verdict,
        "p": together and together.p,
        "cpu_ratio": cpu and cpu.ratio,
        "cpu_ratio_low": interval and interval.low,
        "cpu_ratio_high": interval and interval.high,
    }


def row(record: Record) -> dict[str, Any]:
    """Return a record as a flat row (:mod:`cembench.results.columns`).

    A metric that the record does not have is left out; one that is infinite is None. `seconds_raw`
    holds the figure of each round, `seconds_calls` every timed call by round.
    """
    metrics = record.outcome.metrics
    entries = {
        column.name: column.of(record)
        for column in EXPORTED
        if column.name in metrics or column.name not in _METRICS
    }
    return entries | metrics

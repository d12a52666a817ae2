"""Success rates of algorithms, and the causes of failures."""

from __future__ import annotations

from collections import Counter

from cembench.report.content.evidence import AlgorithmSeries, Evidence
from cembench.report.document import Column, Table, Value, count, words
from cembench.results.intervals import LEVEL
from cembench.results.records import Record, Status

#: Order of the columns; statuses that do not occur are left out.
_STATUSES: tuple[Status, ...] = (
    "invalid",
    "failed",
    "timeout",
    "out_of_memory",
    "not_comparable",
    "skipped",
)
#: Maximum number of kinds of faults listed.
_NAMED = 3


def success_table(evidence: Evidence, policy: str) -> Table:
    """Return a table with a row per algorithm: valid maps, and how the other cells ended."""
    held = {s.label: records_of(evidence, s, policy) for s in evidence.series}
    there = {r.outcome.status for records in held.values() for r in records}
    statuses = [status for status in _STATUSES if status in there]
    columns = (
        Column("algorithm", numeric=False),
        Column("target", numeric=False),
        Column("surfaces"),
        Column("ok"),
        Column("share", unit="%"),
        Column("95 % interval", unit="%"),
        *(Column(status.replace("_", " ")) for status in statuses),
        Column("faults", numeric=False),
    )
    rows = [_row(s, held[s.label], statuses) for s in evidence.series if held[s.label]]
    return Table(
        "success",
        "Success rates",
        columns,
        tuple(rows),
        "Valid maps, and how the other cells ended, for the surfaces that an algorithm takes and "
        "was tried on. The Wilson interval is for the share on other surfaces of this kind. A cell "
        "can have several faults.",
    )


def records_of(evidence: Evidence, series: AlgorithmSeries, policy: str) -> list[Record]:
    """Return the records of a series, one for each surface that it was tried on."""
    found = (evidence.find(surface, series, policy) for surface in evidence.surfaces)
    return [record for record in found if record is not None]


def _row(
    series: AlgorithmSeries, records: list[Record], statuses: list[Status]
) -> tuple[Value, ...]:
    counts = Counter(record.outcome.status for record in records)
    ok, n = counts["ok"], len(records)
    low, high = share_interval(ok, n)
    faults = Counter(kind for r in records for kind in {f.kind for f in r.outcome.faults})
    told = ", ".join(f"{kind.replace('_', ' ')} {k}" for kind, k in faults.most_common(_NAMED))
    return (
        words(series.label),
        words(series.target),
        count(n),
        count(ok),
        Value(f"{100 * ok / n:.1f}", 100 * ok / n, "derived"),
        Value(f"{100 * low:.1f} to {100 * high:.1f}", None, "derived"),
        *(count(counts[status]) for status in statuses),
        words(told or "none"),
    )


def share_interval(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % Wilson interval of a share.

    >>> [round(end, 3) for end in share_interval(10, 10)]
    [0.722, 1.0]
    """
    from scipy.stats import binomtest  # slow to import

    found = binomtest(successes, n).proportion_ci(LEVEL, method="wilson")
    return float(found.low), float(found.high)

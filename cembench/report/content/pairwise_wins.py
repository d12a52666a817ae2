"""Pairwise wins of algorithms over surfaces, with sign tests."""

from __future__ import annotations

from itertools import combinations
from math import inf, isclose, isnan

from cembench.report.content.evidence import ANGLE, DISK, Evidence
from cembench.report.content.printed_beside_measured import policy_suffix
from cembench.report.document import Column, Table, Value, missing, words
from cembench.results.intervals import ERROR
from cembench.results.multiple_testing import holm, sign_test

#: Figures that differ by less than this share count as equal.
SAME = 1e-6


def pairwise_wins(evidence: Evidence, policy: str) -> list[Table]:
    """Return tables of angles and seconds for maps to the disk, if there are several."""
    suffix = policy_suffix(policy, evidence)
    made = (
        _table(evidence, f"wins-angles{suffix}", "Who has the smaller angle errors", policy, ANGLE),
        _table(evidence, f"wins-seconds{suffix}", "Who is faster", policy, "seconds"),
    )
    return [table for table in made if table is not None]


def _table(evidence: Evidence, name: str, title: str, policy: str, figure: str) -> Table | None:
    frame = evidence.frame
    tried = frame[frame["main"] & (frame["target"] == DISK) & (frame["solves"] == policy)]
    series = [s for s in evidence.disk_series if s.label in set(tried["label"])]
    if len(series) < 2:
        return None
    cost = tried[figure].where(tried["ok"]).fillna(inf)
    table = tried.assign(cost=cost).pivot(index="place", columns="label", values="cost")
    scores = {str(label): column.tolist() for label, column in table.items()}
    pairs = list(combinations([s.label for s in series], 2))
    wins = {(a, b): _wins(scores[a], scores[b]) for a, b in pairs}
    chances = holm([sign_test(*wins[pair]) for pair in pairs])
    entries: dict[tuple[str, str], Value] = {}
    for (a, b), chance in zip(pairs, chances, strict=True):
        won, lost = wins[a, b]
        entries[a, b], entries[b, a] = _entry(won, lost, chance), _entry(lost, won, chance)
    rows = [
        (words(a.label), *(entries.get((a.label, b.label), words("")) for b in series))
        for a in series
    ]
    return Table(
        name,
        title,
        (Column("better", numeric=False), *(Column(s.label, "than") for s in series)),
        tuple(rows),
        "Number of surfaces on which the algorithm of the row beats that of the column, out of "
        "those that both were tried on; equal figures are left out. A cell that did not end ok "
        "loses to one that did. A star marks a number beyond chance, with a confidence of "
        f"{100 * (1 - ERROR):.0f} %{_together(len(pairs))}. Only surfaces are counted; the size of "
        "the difference does not matter.",
    )


def _together(pairs: int) -> str:
    if pairs == 1:
        return " (two-sided sign test)"
    return f" for all {pairs} pairs of this table together (two-sided sign tests, Holm)"


def _wins(first: list[float], second: list[float]) -> tuple[int, int]:
    """Return on how many surfaces the first and the second are smaller; untried ones are NaN."""
    both = [(a, b) for a, b in zip(first, second, strict=True) if not (isnan(a) or isnan(b))]
    differ = [(a, b) for a, b in both if not (a == b or isclose(a, b, rel_tol=SAME))]
    won = sum(a < b for a, b in differ)
    return won, len(differ) - won


def _entry(won: int, lost: int, chance: float) -> Value:
    if not won + lost:
        return missing("no surface on which they differ")
    star = " *" if chance <= ERROR else ""
    return Value(f"{won} of {won + lost}{star}", won / (won + lost), "derived")

"""Pairwise wins of algorithms over families of surfaces, with sign tests."""

from __future__ import annotations

from itertools import combinations
from math import inf

from cembench.report.content.evidence import ANGLE, DISK, Evidence
from cembench.report.content.printed_beside_measured import policy_suffix
from cembench.report.document import Column, Table, Value, missing, words
from cembench.results.families import votes
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
    families = [evidence.surfaces[place].family for place in table.index]
    wins = {(a, b): votes(scores[a], scores[b], families, SAME) for a, b in pairs}
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
        "Number of families on most of whose surfaces the algorithm of the row beats that of the "
        "column, out of those with surfaces that both were tried on; ties are left out. A cell "
        "that did not end ok loses to one that did. A star marks a number beyond chance, with a "
        f"confidence of {100 * (1 - ERROR):.0f} %{_together(len(pairs))}. Only families are "
        "counted; the size of the difference does not matter.",
    )


def _together(pairs: int) -> str:
    if pairs == 1:
        return " (two-sided sign test)"
    return f" for all {pairs} pairs of this table together (two-sided sign tests, Holm)"


def _entry(won: int, lost: int, chance: float) -> Value:
    if not won + lost:
        return missing("no family on which they differ")
    star = " *" if chance <= ERROR else ""
    return Value(f"{won} of {won + lost}{star}", won / (won + lost), "derived")

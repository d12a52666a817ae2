"""The first screen of a paper's report: one sentence, and its main claims in at most six rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from cembench.report.content.claims import UNTESTED, under
from cembench.report.content.evidence import Evidence
from cembench.report.content.printed_tables import MEAN_RATE, measured, printed_rates
from cembench.report.content.standings import listed
from cembench.report.document import (
    VERDICTS,
    Claim,
    Plain,
    Table,
    Tone,
    Value,
    missing,
    words,
)
from cembench.report.given_tables import given_table
from cembench.results.families import enough_rounds, rate_interval
from cembench.results.records import MeshOrigin

if TYPE_CHECKING:
    import pandas as pd

#: Maximum number of rows.
ROWS = 6
#: The origins of surfaces that have columns, and their words.
_ORIGINS: dict[MeshOrigin, tuple[str, str]] = {
    "model": ("on {} model of the paper", "on {} models of the paper"),
    "stand-in": ("on {} stand-in", "on {} stand-ins"),
}
_TONES: dict[str, Tone] = {
    **{"as printed": "good", "more than printed": "good", "less than printed": "doubtful"},
    **{"holds": "good", "holds in part": "doubtful", "does not hold here": "bad"},
}


class Rate(NamedTuple):
    """The average rate of speedup over an algorithm: measured, and how it compares with print."""

    text: str
    verdict: str


def headline(evidence: Evidence) -> str:
    """Return who is faster, in words alone; "" for a paper that states no average rate."""
    paper = evidence.paper
    rows = evidence.frame
    rows = rows[rows["main"] & rows["counted"] & rows["algorithm"].isin(paper.compared)]
    rows = rows[rows["paired"] > 0]
    first, *others = evidence.policies
    won, decided = _decided(rows, first)
    if not (rows["solves"] == first).any() or not paper.stated.get("rate"):
        return ""
    reference, names = paper.reference.upper(), [name.upper() for name in paper.compared]
    if decided:
        share = "all" if won == decided else f"{won} of the"
        start = f"{reference} is faster than {listed(names)} in {share} {decided} comparisons "
        start += "that these rounds decide."
    else:
        start = f"The rounds do not decide if {reference} is faster than {listed(names, 'or')}."
    parts = []
    for origin, on in origins_of(evidence).items():
        said: dict[str, list[str]] = {}
        for name in paper.compared:
            rate = _rate(evidence, name, first, origin)
            if rate and rate.verdict in _TONES:
                said.setdefault(rate.verdict, []).append(name.upper())
        each = [f"{verdict} over {listed(slower)}" for verdict, slower in said.items()]
        parts += [f"{on}, its average speedup is {', '.join(each)}."] if each else []
    for policy in others:
        won, decided = _decided(rows, policy)
        more = f"this is with {first}; with {policy}, {reference} is faster in {won} of {decided}."
        parts += [more] if decided else []
    return " ".join([start, *(part[0].upper() + part[1:] for part in parts)])


def _decided(rows: pd.DataFrame, policy: str) -> tuple[int, int]:
    """Return how many comparisons the paper's algorithm wins, and how many are decided."""
    held = rows.loc[rows["solves"] == policy, "verdict"]
    won, lost = (int((held == one).sum()) for one in ("slower", "faster"))
    return won, won + lost


def origins_of(evidence: Evidence) -> dict[MeshOrigin, str]:
    """Return the origins of the surfaces for models, with their numbers in words."""
    here = [surface.origin for surface in evidence.one_per_model]
    return {
        origin: words[here.count(origin) > 1].format(here.count(origin))
        for origin, words in _ORIGINS.items()
        if origin in here
    }


def head_table(evidence: Evidence, tested: Sequence[Claim]) -> Table | None:
    """Return the main claims: what is printed, and what holds here by the origin of surfaces."""
    origins = origins_of(evidence)
    rated = evidence.paper.stated.get("rate")
    rows = list(_rate_rows(evidence, list(origins)))[:ROWS] if rated else []
    rows += list(_claim_rows(evidence, tested, list(origins)))[: ROWS - len(rows)]
    if not rows:
        return None
    note = (
        f"Average speedup: {evidence.paper.rate}, averaged over the models; printed: over all of "
        "the paper, and in other columns over their models. In brackets is the 95 % interval over "
        "models, or of the share of families of surfaces; 'as printed': it contains the figure "
        "printed for these models."
    )
    notes = (note,) if rated else ()
    on = {"origins": [*origins.values()] or ["here"]}
    return given_table("head", rows, each=on, origin="", notes=notes)


def _rate_rows(evidence: Evidence, origins: Sequence[MeshOrigin]) -> Iterator[list[Plain]]:
    paper = evidence.paper
    for policy in evidence.policies:
        for name in paper.compared:
            row: list[Plain] = [
                f"average speedup over {name.upper()}{under(policy, evidence)}",
                f"{paper.stated['rate'][name]:.1f}",
            ]
            for origin in origins:
                rate = _rate(evidence, name, policy, origin)
                row.append(_judged(rate.verdict, rate.text) if rate else missing("not measured"))
            yield row


def _rate(
    evidence: Evidence, algorithm: str, policy: str, origin: MeshOrigin | None = None
) -> Rate | None:
    """Return the average rate over an algorithm, on surfaces of an origin; None without times."""
    rows = measured(evidence, algorithm, policy).dropna(subset="speedup")
    rows = rows if origin is None else rows[rows["origin"] == origin]
    if rows.empty:
        return None
    rates, paper = rows["speedup"].tolist(), evidence.paper
    printed = printed_rates(paper, algorithm, rows["model"].tolist())
    interval = enough_rounds(rows["paired"].tolist()) and rate_interval(
        [1 + rate for rate in rates], rows["family"], log=False
    )
    text, wanted = f"{MEAN_RATE.of(rates):.1f}", MEAN_RATE.of(printed) if printed else None
    of_these = "" if wanted is None else f", printed {wanted:.1f}"
    if not interval or wanted is None:
        return Rate(text + of_these, "too few for an interval")
    side = "more than" if interval.low > wanted else "less than" if interval.high < wanted else "as"
    return Rate(f"{text} ({interval.low:.1f} to {interval.high:.1f}){of_these}", f"{side} printed")


def _claim_rows(
    evidence: Evidence, tested: Sequence[Claim], origins: Sequence[MeshOrigin]
) -> Iterator[list[Plain]]:
    """Yield the paper's main claims, by default the failing ones first.

    What is printed is the same test on the paper's own tables, where they have what it takes.
    """
    order, known = list(VERDICTS), {claim.name: claim for claim in tested}
    ranked = sorted(known.values(), key=lambda claim: order.index(claim.verdict))
    chosen = [known[n] for n in evidence.paper.headline if n in known] or ranked
    for claim in chosen[:ROWS]:
        control = claim.parts.get("printed")
        row: list[Plain] = [claim.plain, control.counted_verdict if control else ""]
        parts = [claim.parts.get(origin) for origin in origins] if origins else [claim]
        row += [_judged(part.verdict, part.counted) if part else words(UNTESTED) for part in parts]
        yield row


def _judged(verdict: str, figures: str) -> Value:
    """Return a verdict, and the figures it rests on, as an entry."""
    return words(f"{verdict}: {figures}" if figures else verdict, _TONES.get(verdict, ""))

"""The claims of a paper with their verdicts on a run.

The paper's folder holds all of a claim: its words, their place, and its test, in words and as
expressions (:class:`cembench.results.papers.StatedClaim`). They are evaluated here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.content.printed_tables import corrected_rate
from cembench.report.document import ORIGINS, VERDICTS, Claim, Judged, Table, Verdict
from cembench.report.given_tables import given_table
from cembench.report.plot_rows import printed
from cembench.results.columns import FITTED
from cembench.results.families import FEWEST_FAMILIES, family_means, share_interval
from cembench.results.frame import evaluate, filled
from cembench.results.papers import StatedClaim

if TYPE_CHECKING:
    import pandas as pd

#: The surfaces' inspections by the hash of the mesh.
Inspections = Mapping[str, Inspection]
Kind: TypeAlias = tuple[str, str]
#: Words for surfaces by origin, after 1 and after larger numbers; the models come first.
_KINDS: Mapping[str, Kind] = {
    "model": ("of the paper's models", "of the paper's models"),
    "stand-in": ("stand-in for a model", "stand-ins for models"),
    "surface": ("surface that is not in the paper", "surfaces that are not in the paper"),
}
_IN_PRINT = ("model as printed", "models as printed")
_NO_MODEL = "None is a model of the paper itself: the verdict is about the algorithms here."
UNTESTED: Verdict = "not tested here"


def claims(evidence: Evidence, inspections: Inspections) -> list[Claim]:
    """Return all claims of the run's paper with their verdicts, in the order of its text.

    Raises
    ------
    ParameterError
        An expression of a claim fails on this run; the message names the claim and its file.
    """
    frame, known = claims_frame(evidence, inspections), known_names(evidence)
    tested = []
    for claim in evidence.paper.claims:
        try:
            tested.append(_tested(evidence, frame, known, claim))
        except ParameterError as error:
            file = evidence.paper.folder / "claims.toml"
            raise ParameterError(f"{file}: claim {claim.name!r}: {error}") from error
    return tested


def claims_frame(evidence: Evidence, inspections: Inspections) -> pd.DataFrame:
    """Return the run's frame with what claims need besides.

    `surface` has the mark of its origin, since a stand-in is named as the model that it stands for.
    `policy` is the number of the linear-algebra policy. `chosen` are the records that stand for
    their algorithm on a surface, whatever the policy. `below_one` is the share of the corners whose
    angles change by less than a degree, `printed_rate` the rate of speedup that the paper prints.
    Figures to which stand-ins were fitted are left out.
    """
    frame = evidence.frame.copy()
    frame.loc[frame["fitted"], [*FITTED]] = np.nan
    by_ok = frame.sort_values("ok", ascending=False, kind="stable")
    chosen = ~by_ok.duplicated(["place", "series"]).reindex(frame.index)
    known = {
        (of_surface, label): angles.below_one
        for of_surface, seen in inspections.items()
        for label, angles in seen.angles.items()
    }
    maps = zip(frame["mesh_hash"], frame["label"], chosen, strict=True)
    return frame.assign(
        surface=frame["surface"] + frame["origin"].map(lambda origin: ORIGINS[origin][1]),
        policy=frame["solves"].map(evidence.policies.index),
        chosen=chosen,
        printed_rate=[
            corrected_rate(evidence.paper, model or "", algorithm)
            for model, algorithm in zip(frame["model"], frame["algorithm"], strict=True)
        ],
        below_one=[known.get((place, label)) if one else None for place, label, one in maps],
    )


def known_names(evidence: Evidence) -> dict[str, Any]:
    """Return what claims know besides the frame: the paper, its functions, and stored meshes."""
    paper = evidence.paper

    def disk(key: str) -> TriangleMesh | None:
        mesh = evidence.mesh(evidence.by_hash[evidence.by_key[key].cell.mesh_hash])
        return mesh if mesh is not None and len(mesh.loops) == 1 else None

    return {
        "disk": disk,
        "under": lambda policy: under(policy, evidence),
        "printed": paper.printed_figure,
        "models_of": lambda plot: paper.plotted(plot).models,
        "exhibits_of": lambda *of: [e.title for e in evidence.exhibits if e.figure in of],
        "tables": paper.tables,
        "compared": paper.compared,
        "reference": evidence.reference,
        **paper.numbers,
        **paper.functions(),
    }


def _tested(
    evidence: Evidence, frame: pd.DataFrame, known: Mapping[str, Any], claim: StatedClaim
) -> Claim:
    """Return a claim with its verdicts: on each origin of surfaces, and on the printed tables.

    A stand-in whose model is in the run has no vote beside it.
    """
    votes = frame["once"]
    by_origin = {origin: frame[votes & (frame["origin"] == origin)] for origin in _KINDS}
    parts = {
        origin: _judged(rows, known, claim, _KINDS[origin])
        for origin, rows in by_origin.items()
        if "measured" in claim.on
    }
    if "printed" in claim.on:
        parts["printed"] = _judged(printed_frame(evidence, frame), known, claim, _IN_PRINT)
    none = filled(claim.none, frame, known) or "Nothing in this run to test it on."
    tested = {origin: part for origin, part in parts.items() if part.verdict != UNTESTED}
    parts = tested or {origin: part for origin, part in parts.items() if part.on}
    voting = [part for origin, part in tested.items() if (origin,) == claim.on or origin in _KINDS]
    first = voting[0] if voting else Judged("", none)
    alone = f"Tested {first.on}." if voting and len(parts) == 1 else ""
    own = _NO_MODEL if voting and "model" not in tested and "measured" in claim.on else ""
    further = filled(claim.further, frame, known)
    remark = " ".join(filter(None, (alone, own, claim.remark, further)))
    found = [one.figures if len(parts) == 1 else one.sentence for one in parts.values()]
    return Claim(
        *(claim.name, claim.quote, claim.place, claim.test, " ".join(found) or none),
        *(first.verdict, remark),
        plain=claim.plain or claim.quote,
        counted=first.counted,
        parts=tested,
    )


def _judged(rows: pd.DataFrame, known: Mapping[str, Any], claim: StatedClaim, kind: Kind) -> Judged:
    """Return the verdict on some rows; `kind` says what they are of, after 1 and after a number."""
    import pandas as pd

    chosen = rows[evaluate(claim.rows, rows, known)]
    if claim.algorithms:
        chosen = chosen[chosen["algorithm"].isin(claim.algorithms)]
    groups = chosen.groupby(list(claim.per), dropna=False) if claim.per else [((), chosen)]
    cases: list[dict[str, Any]] = []
    places: set[int] = set()
    for values, group in groups:
        case = _case(claim, group, known, dict(zip(claim.per, values, strict=True)))
        if case is not None:
            cases.append(case)
            places |= set(group["place"]) if case["of"] or case["lacking"] else set()
            case["family"] = group["family"].iloc[0] if "place" in claim.per else None
    if not cases:
        return Judged("", "")
    names = (*claim.per, *claim.each, "of", "lacking", "holds")
    columns = {name: pd.Series([case[name] for case in cases]) for name in names}
    tested, lacking = (int(columns[name].sum()) for name in ("of", "lacking"))
    held = int(sum(case["holds"] for case in cases if case["of"]))
    values = {**known, **columns, "held": held, "tested": tested}
    return Judged(
        f"on {len(places)} {kind[len(places) > 1]}",
        filled(claim.figures, rows, values),
        verdict_of(held, tested, lacking),
        counted(cases) if tested else "",
    )


def printed_frame(evidence: Evidence, frame: pd.DataFrame) -> pd.DataFrame:
    """Return what the paper prints in the columns of a claims frame, as if it had been measured.

    A claim's test on it is a control: what the printed tables themselves say.
    """
    rows = printed(evidence)
    rows = rows.reindex(columns=rows.columns.union(frame.columns, sort=False))
    flags = dict.fromkeys(("ok", "main", "chosen", "counted", "once"), True)
    rate = [
        corrected_rate(evidence.paper, model, algorithm)
        for model, algorithm in zip(rows["model"], rows["algorithm"], strict=True)
    ]
    rates = dict.fromkeys(("speedup", "speedup_low", "speedup_high", "printed_rate"), rate)
    rates |= dict.fromkeys(("seconds_low", "seconds_high"), rows["seconds"])
    faster = np.where(np.array(rate, dtype=float) > 0, "slower", "faster")
    return rows.assign(
        **(flags | rates | dict.fromkeys(("verdict", "verdict_corrected"), faster)),
        reference=rows["algorithm"] == evidence.reference,
        title=rows["label"],
        policy=0,
        solves="",
        family=rows["model"].map(evidence.paper.object_of),
    )


def counted(cases: Sequence[Mapping[str, Any]]) -> str:
    """Return how many tests hold; with enough families, the interval of their share."""
    tested = [case for case in cases if case["of"]]
    held, of = (int(sum(case[name] for case in tested)) for name in ("holds", "of"))
    shares = [case["holds"] / case["of"] for case in tested]
    families = [case["family"] for case in tested]
    own = family_means(shares, families)
    if None in families or len(own) < FEWEST_FAMILIES:
        return f"{held} of {of}"
    between = share_interval(sum(own) / len(own), len(own))
    return f"{held} of {of} ({100 * between.low:.0f} to {100 * between.high:.0f} % of families)"


#: Columns of the claims at a glance, by origin.
_HEADINGS = {
    "model": "on the models",
    "stand-in": "on stand-ins",
    "surface": "on other surfaces",
    "printed": "by the printed tables",
}


def at_a_glance(tested: Sequence[Claim]) -> Table:
    """Return all claims in a line each, failing ones first."""
    order = list(VERDICTS)
    known = {origin for claim in tested for origin in claim.parts}
    headings = {origin: text for origin, text in _HEADINGS.items() if origin in known}
    rows = []
    for claim in sorted(tested, key=lambda claim: order.index(claim.verdict)):
        parts = [claim.parts.get(origin) for origin in headings]
        cells = [part.counted_verdict if part else None for part in parts]
        rows.append((claim.plain, *cells, claim.place))
    on = {"origins": [*headings.values()]}
    texts = {"families": FEWEST_FAMILIES}
    return given_table("claims-at-a-glance", rows, texts, each=on, origin="")


def in_short(tested: Sequence[Claim]) -> Table:
    """Return what an editor asks first: what holds on the models, and what nobody can decide."""
    on_models = {claim.name: claim.parts.get("model") for claim in tested}

    def models(verdict: Verdict) -> list[Claim]:
        return [c for c in tested if (part := on_models[c.name]) and part.verdict == verdict]

    refuted = [c for c in tested if (p := c.parts.get("printed")) and p.verdict != "holds"]
    lists = {
        "hold on the paper's models": models("holds"),
        "hold there in part": models("holds in part"),
        "do not hold there": models("does not hold here"),
        "are not borne out by the paper's own tables": refuted,
        "could be tested on stand-ins or other surfaces alone": [
            c for c in tested if c.parts and not on_models[c.name] and set(c.parts) != {"printed"}
        ],
        "could not be tested": [claim for claim in tested if not claim.parts],
    }
    rows = [
        (f"{len(claims)} {what}", " ".join(claim.plain for claim in claims))
        for what, claims in lists.items()
        if claims
    ]
    return given_table("claims-in-short", rows, origin="")


def _case(
    claim: StatedClaim, group: pd.DataFrame, known: Mapping[str, Any], case: dict[str, Any]
) -> dict[str, Any] | None:
    """Return the values of a case; None if it is not tested."""
    if group.empty or not set(claim.algorithms) <= set(group["algorithm"]):
        return None
    wanted = {**claim.each, "of": claim.of, "lacking": claim.lacking, "holds": claim.holds}
    for name, expression in wanted.items():
        case[name] = evaluate(expression, group, {**known, **case})
        if case[name] is None:
            return None
    return case


def verdict_of(held: int, tested: int, lacking: int = 0) -> Verdict:
    """Return the verdict: holds everywhere, in part, nowhere, or was not tested.

    `lacking` is the number of tests that lack rounds. A single round does not show how much the
    next one would differ, so they decide nothing.

    >>> [verdict_of(*counts) for counts in ((3, 3), (2, 3), (0, 3), (0, 0))]
    ['holds', 'holds in part', 'does not hold here', 'not tested here']
    >>> verdict_of(0, 0, lacking=1)
    'too few rounds'
    """
    if tested == 0:
        return "too few rounds" if lacking else "not tested here"
    if held == tested:
        return "holds"
    return "holds in part" if held else "does not hold here"


def under(policy: str, evidence: Evidence) -> str:
    """Return the policy of a figure if the run has several, else ""."""
    return f" ({policy})" if policy and len(evidence.policies) > 1 else ""

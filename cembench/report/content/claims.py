"""The claims of a paper with their verdicts on a run.

The paper's folder holds all of a claim: its words, their place, and its test, in words and as
expressions (:class:`cembench.results.papers.StatedClaim`). They are evaluated here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.content.inspection import Inspection
from cembench.report.content.printed_tables import corrected_rate
from cembench.report.document import ORIGINS, VERDICTS, Claim, Column, Table, Verdict
from cembench.results.families import FEWEST_FAMILIES, family_means, share_interval
from cembench.results.frame import evaluate, filled
from cembench.results.papers import StatedClaim
from cembench.results.records import MeshOrigin

if TYPE_CHECKING:
    import pandas as pd

#: The surfaces' inspections by the hash of the mesh.
Inspections = Mapping[str, Inspection]
#: Words for surfaces by origin.
_KINDS: Mapping[MeshOrigin, str] = {
    "model": "the paper's own models",
    "stand-in": "stand-ins for the paper's models",
    "surface": "surfaces that are not in the paper",
}


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
    """
    frame = evidence.frame
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
    """Return a claim with its verdict."""
    import pandas as pd

    rows = frame[evaluate(claim.rows, frame, known)]
    if claim.algorithms:
        rows = rows[rows["algorithm"].isin(claim.algorithms)]
    groups = rows.groupby(list(claim.per), dropna=False) if claim.per else [((), rows)]
    cases: list[dict[str, Any]] = []
    places: set[int] = set()
    for values, group in groups:
        case = _case(claim, group, known, dict(zip(claim.per, values, strict=True)))
        if case is not None:
            cases.append(case)
            places |= set(group["place"]) if case["of"] else set()
            case["family"] = group["family"].iloc[0] if "place" in claim.per else None
    names = (*claim.per, *claim.each, "of", "lacking", "holds")
    columns = {name: pd.Series([case[name] for case in cases]) for name in names}
    tested, lacking = (int(columns[name].sum()) for name in ("of", "lacking"))
    held = int(sum(case["holds"] for case in cases if case["of"]))
    values = {**known, **columns, "held": held, "tested": tested}
    over = evaluate(claim.over, frame, values) if claim.over else frame["place"].isin(places)
    surfaces = None if over is None else sorted(set(frame["place"][over]))
    where = None if surfaces is None else tested_on([evidence.surfaces[k] for k in surfaces])
    figures = filled(claim.none if claim.none and not cases else claim.figures, frame, values)
    remark = " ".join(filter(None, (where, claim.remark, filled(claim.further, frame, values))))
    verdict = verdict_of(held, tested, lacking)
    return Claim(
        *(claim.name, claim.quote, claim.place, claim.test, figures, verdict, remark),
        plain=claim.plain or claim.quote,
        counted=counted(cases) if tested else "",
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


def at_a_glance(tested: Sequence[Claim]) -> Table:
    """Return all claims in a line each, failing ones first."""
    order = list(VERDICTS)
    rows = [
        (claim.plain, claim.verdict, claim.counted or None, claim.place)
        for claim in sorted(tested, key=lambda claim: order.index(claim.verdict))
    ]
    lacking = "nothing to test it on, or too few rounds"
    titles = ("claim", "verdict", "holds in", "place")
    columns = [Column(title, numeric=False, lacking=lacking) for title in titles]
    caption = (
        "How many tests hold. In brackets is the 95 % interval of the share of families of "
        f"surfaces on which it holds, where there are at least {FEWEST_FAMILIES}."
    )
    return Table.of(
        "claims-at-a-glance", "The claims at a glance", columns, rows, origin="", caption=caption
    )


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


def tested_on(surfaces: Sequence[MeasuredSurface]) -> str:
    """Return a sentence on the kinds of surfaces behind a verdict."""
    counts = Counter(surface.origin for surface in surfaces)
    kinds = [f"{counts[kind]} on {words}" for kind, words in _KINDS.items() if counts[kind]]
    if not kinds:
        return "Nothing in this run to test it on."
    own = " None is a model of the paper itself: the verdict is about the algorithms here."
    return f"Surfaces tested: {', '.join(kinds)}.{own * (not counts['model'])}"


def under(policy: str, evidence: Evidence) -> str:
    """Return the policy of a figure if the run has several, else ""."""
    return f" ({policy})" if len(evidence.policies) > 1 else ""

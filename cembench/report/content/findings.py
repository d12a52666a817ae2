"""The findings at the head of a report: sentences, suspect maps and key figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import mean

from cembench.report.content.by_surface import own_table
from cembench.report.content.evidence import ANGLE, AS_GOOD, DEGREES, Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.content.own_claim import claim_of_the_paper, verdicts_counted
from cembench.report.content.standings import (
    NEAR,
    AngleRatio,
    Field,
    Standing,
    compare_angles,
    compare_seconds,
    field_of,
    listed,
)
from cembench.report.document import Claim, Figure, Finding, Findings, Sentence
from cembench.results.comparison import Comparison
from cembench.results.families import FEWEST_FAMILIES, family_means, share_interval
from cembench.results.outliers import outlier_lines
from cembench.results.stability import scatter_words, stability_words


def findings(
    evidence: Evidence, inspections: Mapping[str, Inspection], claims: Sequence[Claim]
) -> Findings:
    """Return the head of a report.

    With `claims`, those of the paper, it opens with the paper's own claim and all verdicts.
    Without, the run is over the user's own surfaces: it has their table. Then, for maps to the disk
    under the run's first policy: whose angle errors are the smallest, and who is the fastest of
    those that are as good.
    """
    field = field_of(evidence, evidence.policies[0])
    sentences: list[Sentence] = []
    if claims:
        stated = [(claim_of_the_paper(evidence),)] if evidence.paper.stated else []
        sentences = [*stated, verdicts_counted(claims)]
    told = field_words(field) if field else ["No map to the disk to compare."]
    if claims and field:
        told[0] = _beside_the_paper(evidence.paper.algorithms, field, told[0])
    told += [stability_words(evidence.records), scatter_words(evidence.records)]
    sentences += [(words,) for words in told if words]
    best = field.standings[0].label if field else evidence.reference
    return Findings(
        tuple(sentences),
        tuple(outlier_lines(evidence.records)),
        None if claims else own_table(evidence),
        (*(field_figures(field) if field else ()), _ended(evidence)),
        _picture(evidence, inspections, best),
    )


def _beside_the_paper(known: Sequence[str], field: Field, sentence: str) -> str:
    """Return a sentence with the algorithms that are not in the paper in front, if any."""
    extra = [s.label for s in field.standings if s.series.algorithm not in known]
    if not extra:
        return sentence
    are = "is" if len(extra) == 1 else "are"
    start = f"With {listed(extra)}, which {are} not in the paper: "
    return start + sentence[0].lower() + sentence[1:]


def surfaces_words(surfaces: int, families: int) -> str:
    """Return a number of surfaces, and of the families that they are of if these are fewer."""
    return f"{surfaces} surfaces" + (f" of {families} families" if families < surfaces else "")


def field_words(field: Field) -> list[str]:
    """Return sentences on whose angle errors are the smallest, and who is the fastest."""
    best, *others = field.standings
    out = f" Left out, with too few maps: {listed(field.left_out)}." if field.left_out else ""
    if not others:
        return [f"Only {best.label} mapped {_on(field)}: there is nothing to compare it with.{out}"]
    counts = [f"{_counts(field, best, others[0])}."] if field.n > 1 else []
    return [_angles(field, best, others) + out, *counts, _fastest(field)]


def _on(field: Field) -> str:
    if field.n < field.surfaces:
        of = f", {field.families} families" if field.families < field.n else ""
        return f"the {field.n} of {field.surfaces} surfaces that all of them mapped{of}"
    return "one surface" if field.n == 1 else surfaces_words(field.n, field.families)


def _angles(field: Field, best: Standing, others: Sequence[Standing]) -> str:
    """Return a sentence that names the smallest angle errors, or those that are as good."""
    second = others[0]
    found = compare_angles(second, best)
    unsure = [s for s in others if not compare_angles(s, best).is_sure]
    equal = [s for s in unsure if s in field.good]
    if found.is_sure:
        head = f"{best.label} has the smallest angle errors"
        if unsure:
            head += f" (not decided against {listed([s.label for s in unsure])})"
    elif equal:
        head = f"{listed([best.label, *(s.label for s in equal)])} have equally good angle errors"
    else:
        head = f"{best.label} has the lowest angle errors on average"
    ratio = f"{second.label}'s are {found.mean:.3f} times {best.label}'s{_certainty(field, found)}"
    return f"On {_on(field)}, {head}; {ratio}."


def _certainty(field: Field, found: AngleRatio) -> str:
    """Return the interval over families of a ratio, and its median, in brackets."""
    if field.n == 1:
        return ""
    interval = (
        f"95 % interval over {field.families} families "
        f"{found.interval.low:.3f} to {found.interval.high:.3f}"
        if found.interval
        else f"too few families for an interval: {field.families}"
    )
    return f" ({interval}; median {found.median:.3f})"


def _counts(field: Field, *standings: Standing) -> str:
    """Return how often angle errors are the smallest, or nearly: in families, if these suffice."""
    if field.families < FEWEST_FAMILIES:
        return "; ".join(
            f"{s.label} has the smallest angle errors on {sum(field.near(s, 0))} of {field.n} "
            f"surfaces and is within {100 * NEAR:.0f} % of the best on {sum(field.near(s, NEAR))}"
            for s in standings
        )
    shares = [
        [mean(family_means(field.near(s, within), s.families)) for within in (0, NEAR)]
        for s in standings
    ]
    around = [share_interval(best, field.families) for best, _ in shares]
    return "; ".join(
        f"{s.label} has the smallest angle errors in {100 * best:.0f} % of {field.families} "
        f"families (95 % interval {100 * i.low:.0f} to {100 * i.high:.0f}) and is within "
        f"{100 * NEAR:.0f} % of the best in {100 * near:.0f} %"
        for s, (best, near), i in zip(standings, shares, around, strict=True)
    )


def _fastest(field: Field) -> str:
    """Return a sentence that names the fastest of the algorithms with good angles."""
    within = f"at most {AS_GOOD} times the smallest, or {DEGREES}° larger, on every surface"
    good = field.good
    if len(good) < 2:
        return f"No two algorithms have angle errors of {within}: no fastest of them is named."
    names = listed([s.label for s in good[:2]])
    compared = compare_seconds(good[1], good[0])
    fastest = (
        f"{good[0].label} is the fastest"
        if compared is not None and compared.verdict == "slower"
        else f"{names} are the fastest (these rounds do not show which of the two)"
    )
    larger = [s.label for s in field.standings if s not in good]
    less = f" (not {listed(larger)})" if larger else ""
    return f"Of {len(good)} algorithms with angle errors of {within}{less}, {fastest}."


def field_figures(field: Field) -> list[Finding]:
    """Return the key figures: the fastest against the next, and the best angles."""
    figures = []
    good, best = field.good, field.standings[0]
    compared = compare_seconds(good[1], good[0]) if len(good) > 1 else None
    if compared is not None:
        figures.append(_times(field, good[0], good[1], compared))
    figures.append(
        Finding(
            f"{best.angle:.2f}°",
            f"mean angle error of {best.label}, the lowest of {len(field.standings)}"
            + (f" (geometric mean over {_families(field)})" if field.n > 1 else ""),
        )
    )
    return figures


def _families(field: Field) -> str:
    return f"{field.families} {'families' if field.families > 1 else 'family'}"


def _times(field: Field, first: Standing, second: Standing, compared: Comparison) -> Finding:
    interval = compared.interval
    over = f" over {_families(field)}" if field.families >= FEWEST_FAMILIES else ""
    told = (
        f"95 % interval{over} {interval.low:.2f} to {interval.high:.2f}"
        if interval
        else f"{compared.rounds} round{'s' if compared.rounds > 1 else ''}: too few for an interval"
    )
    return Finding(
        f"{compared.ratio:.2f} times",
        f"the speed of {second.label}, the next fastest, is reached by {first.label}; {told}",
    )


def _ended(evidence: Evidence) -> Finding:
    ok = sum(record.outcome.status == "ok" for record in evidence.records)
    return Finding(f"{ok} of {len(evidence.records)}", "cells ended with a valid map")


def _picture(
    evidence: Evidence, inspections: Mapping[str, Inspection], label: str
) -> Figure | None:
    """Return a picture by the algorithm with the best angles, of the largest surface with one."""
    reference = evidence.series_of(evidence.reference)
    for wanted in (label, reference.label if reference else label):
        for surface in sorted(evidence.surfaces, key=lambda s: -s.faces):
            found = inspections.get(surface.mesh_hash)
            if found and wanted in found.checkerboards:
                return found.checkerboards[wanted]
    return None


def many_findings(evidence: Evidence) -> Findings:
    """Return who mapped everything, whose maps to the disk are the best, and suspect maps.

    All of it is under the run's first policy.
    """
    policy = evidence.policies[0]
    main = evidence.frame[evidence.frame["main"] & (evidence.frame["solves"] == policy)]
    ok = main.sort_values("series", kind="stable").groupby("label", sort=False)["ok"]
    whole = [str(label) for label, all_ok in ok.all().items() if all_ok]
    sentences = [
        f"Over {surfaces_words(len(evidence.surfaces), evidence.families)}, {len(whole)} of "
        f"{len(ok)} algorithms have a "
        f"valid map of every one that they take{f': {listed(whole)}' if whole else ''}."
    ]
    figures = [Finding(f"{100 * main['ok'].mean():.1f} %", f"of {len(main)} cells are valid maps")]
    field = field_of(evidence, policy)
    if field is not None:
        sentences += field_words(field)
        figures += field_figures(field)
    valid = main[main["ok"]]
    if valid[ANGLE].notna().any():
        worst = valid.loc[valid[ANGLE].idxmax()]
        where = f"{worst['label']}, {worst['surface']}"
        figures.append(
            Finding(f"{worst[ANGLE]:.1f}°", f"the worst mean angle error of a valid map: {where}")
        )
    sentences.append(stability_words(evidence.records))
    return Findings(
        tuple((words,) for words in sentences if words),
        tuple(outlier_lines(evidence.records)),
        figures=tuple(figures),
    )

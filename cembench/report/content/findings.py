"""The findings at the head of a report: sentences, suspect maps and key figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import exp, log
from statistics import mean, median
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cembench.report.content.claims import under
from cembench.report.content.evidence import (
    ANGLE,
    AS_GOOD,
    DEGREES,
    DISK,
    Evidence,
)
from cembench.report.content.inspection import Inspection
from cembench.report.content.printed_tables import MEAN_RATE, measured, printed_rates
from cembench.report.declarations import own
from cembench.report.declared import declared_table
from cembench.report.document import VERDICTS, Claim, Figure, Finding, Findings, Sentence
from cembench.results.comparison import Comparison, compare_ratios, paired_ratios, verdict_of
from cembench.results.families import (
    FEWEST_FAMILIES,
    average_interval,
    enough_rounds,
    family_means,
    rate_interval,
    share_interval,
)
from cembench.results.frame import phrase
from cembench.results.intervals import DEFAULT_ROUNDS, Interval, share_of
from cembench.results.stability import outlier_lines, scatter_words, stability_words

if TYPE_CHECKING:
    import pandas as pd

#: An algorithm takes part with maps of at least this share of the surfaces that most mapped.
SHARE = 0.9
#: Smaller mean angle errors, in degrees, count as this: their ratios are of rounding.
FLOOR = 0.01
#: An angle error within this share of the smallest one of a surface counts as equal to it.
NEAR = 0.01


def as_good(angles: Sequence[float], best: Sequence[float]) -> bool:
    """Whether maps are about as good as the best ones on every surface.

    Both are mean angle errors in degrees, one per surface.
    """
    return all(a <= max(AS_GOOD * b, b + DEGREES) for a, b in zip(angles, best, strict=True))


class Over(NamedTuple):
    """A mean over families, their median, and the interval of the mean; None for fewer than six."""

    mean: float
    median: float
    interval: Interval | None


def field_of(evidence: Evidence, policy: str) -> dict[str, Any]:
    """Compare the main algorithms that map to the disk, on the surfaces that all of them mapped.

    Those that mapped fewer than :data:`SHARE` of what others did are `absent`. The names are those
    of `findings.toml`; empty if there is no surface. `order` has the smallest angle errors first,
    `good` the algorithms that are as good as the best on every surface, the fastest first.
    """
    frame = evidence.frame
    disks = frame[(frame["target"] == DISK) & frame["main"] & (frame["solves"] == policy)]
    maps = disks[disks["ok"] & (disks["seconds"] > 0) & disks[ANGLE].notna()]
    if maps.empty:
        return {}
    wide = maps.pivot(index="place", columns="label", values=["key", ANGLE, "seconds"])
    number, tried = wide["key"].notna().sum(), [s.label for s in evidence.disk_series if s.main]
    chosen = [one for one in tried if number.get(one, 0) >= SHARE * max(number, default=1)]
    common = wide[wide["key"][chosen].notna().all(axis=1)]
    if common.empty:
        return {}
    families = [evidence.surfaces[place].family for place in common.index]
    keys, seconds = common["key"], common["seconds"].astype(float)
    angles = common[ANGLE].astype(float).clip(lower=FLOOR)
    means = {one: _over_families(angles[one], families).mean for one in chosen}
    order = best, *others = sorted(chosen, key=means.__getitem__)
    least = angles[order].min(axis=1)
    good = [one for one in order if as_good(angles[one], least)]
    good.sort(key=lambda one: _over_families(seconds[one], families).mean)
    against = {one: _over_families(angles[one] / angles[best], families) for one in others}
    sure = {o for o, speeds in against.items() if speeds.interval and speeds.interval.low > 1}
    known: dict[str, Any] = {
        **{"order": order, "best": best, "others": others, "good": good, "angle_mean": means[best]},
        **{"n": len(common), "surfaces": len(wide), "families": len(set(families))},
        **{"absent": [one for one in tried if one not in chosen], "times": AS_GOOD},
        **{"worse": [one for one in order if one not in good], "degrees": DEGREES},
        **{"names": listed, "surfaces_words": surfaces_words, "within": f"{100 * NEAR:.0f}"},
        "few": len(set(families)) < FEWEST_FAMILIES,
    }
    if others:
        unsure = [one for one in others if one not in sure]
        known |= {"second": others[0], "sure": others[0] in sure, "unsure": unsure}
        known |= {"equal": [one for one in unsure if one in good]}
        ratio, middle, between = against[others[0]]
        known |= {"ratio": ratio, "middle": middle, "between": _ends(between)}
        for name, within in (("smallest", 0), ("nearly", NEAR)):
            near = [angles[one] <= (1 + within) * least for one in (best, others[0])]
            known[name] = [
                int(one.sum()) if known["few"] else mean(family_means(one.tolist(), families))
                for one in near
            ]
        if not known["few"]:
            around = [share_interval(share, known["families"]) for share in known["smallest"]]
            known["shares"] = [(100 * one.low, 100 * one.high) for one in around]
    speeds, timed = _speeds(evidence, keys, good, families) if len(good) > 1 else (None, 0)
    known |= {"timed": timed, "few_timed": timed < FEWEST_FAMILIES}
    known["verdict"] = speeds and speeds.verdict
    known |= {
        "speeds": _ends(speeds.interval if speeds else None),
        "speed_ratio": speeds and speeds.ratio,
    }
    for name, cases in own("findings.toml").items():
        if others or name not in _OF_SEVERAL:
            known[name] = phrase(cases, frame, known)
    return known


#: Phrases that compare the best algorithm with the next.
_OF_SEVERAL = ("head", "certainty")


def _ends(interval: Interval | None) -> tuple[float, float] | None:
    return (interval.low, interval.high) if interval else None


def _over_families(values: Sequence[float], families: Sequence[str]) -> Over:
    """Return the geometric mean over families of the geometric means within them."""
    logs = family_means([log(value) for value in values], families)
    return Over(exp(mean(logs)), exp(median(logs)), average_interval(values, families))


def _speeds(
    evidence: Evidence, keys: pd.DataFrame, good: Sequence[str], families: Sequence[str]
) -> tuple[Comparison | None, int]:
    """Compare the two fastest algorithms by the ratios of their seconds within rounds.

    With enough families their geometric mean decides, which is a statement on other families;
    otherwise the means over the surfaces in each round do, a statement on these surfaces. Surfaces
    on which they share no round are left out. The second value is the number of families.
    """
    slower, faster = ([evidence.by_key[key] for key in keys[good[k]]] for k in (1, 0))
    paired = [paired_ratios(a, b) for a, b in zip(slower, faster, strict=True)]
    families = [family for family, ratios in zip(families, paired, strict=True) if ratios]
    ratios = list(filter(None, paired))
    if not ratios:
        return None, 0
    if len(set(families)) >= FEWEST_FAMILIES:
        middles = [exp(median(map(log, ratio))) for ratio in ratios]
        over = _over_families(middles, families)
        compared = Comparison(over.mean, over.interval, verdict_of(over.interval), len(ratios))
        return compared, len(set(families))
    rounds = min(map(len, ratios))
    share = share_of(rounds, *(record.cell for record in (*slower, *faster)))
    together = np.log([ratio[:rounds] for ratio in ratios]).mean(axis=0)
    return compare_ratios(np.exp(together).tolist(), share), len(set(families))


def listed(names: Sequence[str]) -> str:
    """Return names as "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def findings(
    evidence: Evidence, inspections: Mapping[str, Inspection], claims: Sequence[Claim]
) -> Findings:
    """Return the head of a report.

    With `claims`, those of the paper, it opens with the paper's own claim and all verdicts; without
    them, with the table of the user's own surfaces. Then, for maps to the disk under the run's
    first policy, come whose angle errors are the smallest, and who is the fastest of those that are
    as good.
    """
    field = field_of(evidence, evidence.policies[0])
    sentences: list[Sentence] = []
    if claims:
        stated = [(claim_of_the_paper(evidence),)] if evidence.paper.stated else []
        sentences = [*stated, verdicts_counted(claims)]
    field_sentences = field_words(field) if field else ["No map to the disk to compare."]
    if claims and field:
        field_sentences[0] = _beside_the_paper(evidence, field, field_sentences[0])
    field_sentences += [stability_words(evidence.records), scatter_words(evidence.records)]
    sentences += [(words,) for words in field_sentences if words]
    best = field["best"] if field else evidence.reference
    return Findings(
        tuple(sentences),
        tuple(outlier_lines(evidence.records)),
        None if claims else declared_table(evidence, "own-surfaces"),
        (*(field_figures(field) if field else ()), _ended(evidence)),
        _picture(evidence, inspections, best),
    )


def _beside_the_paper(evidence: Evidence, field: Mapping[str, Any], sentence: str) -> str:
    """Return a sentence with the algorithms that are not in the paper in front, if any."""
    known = [s.label for s in evidence.series if s.algorithm in evidence.paper.algorithms]
    extra = [label for label in field["order"] if label not in known]
    if not extra:
        return sentence
    are = "is" if len(extra) == 1 else "are"
    start = f"With {listed(extra)}, which {are} not in the paper: "
    return start + sentence[0].lower() + sentence[1:]


def surfaces_words(surfaces: int, families: int) -> str:
    """Return a number of surfaces, and of the families that they are of if these are fewer."""
    return f"{surfaces} surfaces" + (f" of {families} families" if families < surfaces else "")


def field_words(field: Mapping[str, Any]) -> list[str]:
    """Return sentences on whose angle errors are the smallest, and who is the fastest."""
    return [field[name] for name in ("angles", "counts", "fastest") if field[name]]


def field_figures(field: Mapping[str, Any]) -> list[Finding]:
    """Return the key figures: the fastest against the next, and the best angles."""
    figures = [Finding(f"{field['angle_mean']:.2f}°", field["angle"])]
    if field["speed"]:
        figures.insert(0, Finding(f"{field['speed_ratio']:.2f} times", field["speed"]))
    return figures


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
            inspection = inspections.get(surface.mesh_hash)
            if inspection and wanted in inspection.checkerboards:
                return inspection.checkerboards[wanted]
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
    if field:
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


#: Verdicts whose claims are named in the count.
_NAMED = ("does not hold here", "holds in part")


def claim_of_the_paper(evidence: Evidence) -> str:
    """Return the paper's average rates of speedup beside those of this run, as a sentence.

    A measured rate has its 95 % interval over models in brackets where there are enough of them
    and of rounds (:func:`cembench.results.families.rate_interval`).
    """
    paper = evidence.paper
    names = ", ".join(algorithm.upper() for algorithm in paper.compared)
    printed = ", ".join(f"{paper.stated['rate'][algorithm]:.1f}" for algorithm in paper.compared)
    these = [surface.paper_row for surface in evidence.one_per_model]
    if len(these) < len(paper.models):
        means = [MEAN_RATE.of(printed_rates(paper, one, these)) for one in paper.compared]
        own = ", ".join("-" if mean is None else f"{mean:.1f}" for mean in means)
        printed += f" over all models, {own} over these"
    by_policy = [(policy, _rates(evidence, policy)) for policy in evidence.policies]
    rates_here = "; ".join(f"{rates}{under(policy, evidence)}" for policy, (rates, _) in by_policy)
    origins = Counter(surface.origin for surface in evidence.one_per_model)
    models, others = origins["model"], origins["stand-in"]
    over = [f"{models} of its models"] if models else []
    over += [f"{others} stand-in{'s' if others > 1 else ''}"] if others else []
    intervals = (
        "with 95 % intervals over models"
        if any(sure for _, (_, sure) in by_policy)
        else f"too few for an interval ({DEFAULT_ROUNDS} rounds on {FEWEST_FAMILIES} models)"
    )
    return (
        f"{paper.reference.upper()} against {names}: printed {printed}; here {rates_here}. This is "
        f"{paper.rate}, averaged over the models; here over {' and '.join(over)}, {intervals}."
    )


def _rates(evidence: Evidence, policy: str) -> tuple[str, bool]:
    """Return the measured averages as text, and whether one of them has an interval."""
    phrases, sure = [], False
    for algorithm in evidence.paper.compared:
        rows = measured(evidence, algorithm, policy).dropna(subset="speedup")
        rates = rows["speedup"].tolist()
        interval = enough_rounds(rows["paired"].tolist()) and rate_interval(
            [1 + rate for rate in rates], rows["family"], log=False
        )
        between = f" ({interval.low:.1f} to {interval.high:.1f})" if interval else ""
        phrases.append(f"{MEAN_RATE.of(rates):.1f}{between}" if rates else "not measured")
        sure = sure or bool(interval)
    return ", ".join(phrases), sure


def verdicts_counted(claims: Sequence[Claim]) -> Sentence:
    """Return the numbers of all verdicts, failing ones first and with links to their claims."""
    parts: list[str | Claim] = [f"Of {len(claims)} claim{'s' * (len(claims) > 1)} of the paper, "]
    for verdict, (one, several) in VERDICTS.items():
        claims_of = [claim for claim in claims if claim.verdict == verdict]
        if claims_of:
            parts.append(f"{'; ' if len(parts) > 1 else ''}{len(claims_of)} ")
            parts.append(one if len(claims_of) == 1 else several)
        for k, claim in enumerate(claims_of if verdict in _NAMED else ()):
            parts += [", " if k else ": ", claim]
    return (*parts, ".")

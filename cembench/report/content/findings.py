"""The findings at the head of a report: sentences, suspect maps and key figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log
from statistics import mean, median

import numpy as np

from cembench.report.content.claims import under
from cembench.report.content.evidence import (
    ANGLE,
    AS_GOOD,
    DEGREES,
    DISK,
    AlgorithmSeries,
    Evidence,
)
from cembench.report.content.inspection import Inspection
from cembench.report.content.printed_tables import MEAN_RATE, measured_rates
from cembench.report.content.speedup_significance import paired_rounds
from cembench.report.declared import declared_table
from cembench.report.document import VERDICTS, Claim, Figure, Finding, Findings, Sentence
from cembench.results.comparison import Comparison, compare_ratios, paired_ratios
from cembench.results.families import (
    FEWEST_FAMILIES,
    average_interval,
    family_means,
    rate_interval,
    share_interval,
)
from cembench.results.intervals import DEFAULT_ROUNDS, Interval
from cembench.results.records import Record
from cembench.results.stability import outlier_lines, scatter_words, stability_words

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


@dataclass(frozen=True)
class Standing:
    """An algorithm's records on the common surfaces.

    `families` are those of the records' surfaces, `angles` their mean angle errors in degrees, none
    below :data:`FLOOR`, and `angle` and `seconds` geometric means over families.
    """

    series: AlgorithmSeries
    records: tuple[Record, ...]
    families: tuple[str, ...]
    angles: list[float]
    angle: float
    seconds: float

    @property
    def label(self) -> str:
        """The algorithm's name in this run."""
        return self.series.label


@dataclass(frozen=True)
class AngleRatio:
    """The angle errors of an algorithm over those of another on the same surfaces.

    All three are over families; the interval is None for fewer than six.
    """

    mean: float
    median: float
    interval: Interval | None

    @property
    def is_sure(self) -> bool:
        """Whether the interval shows that the other's are smaller."""
        return self.interval is not None and self.interval.low > 1


@dataclass(frozen=True)
class Field:
    """The algorithms that are compared, those with the smallest angle errors first."""

    standings: tuple[Standing, ...]
    #: Number of surfaces that an algorithm for disks mapped.
    surfaces: int
    #: Labels of the algorithms that mapped too few of them.
    left_out: tuple[str, ...]

    @property
    def n(self) -> int:
        """Number of surfaces that all of them mapped."""
        return len(self.standings[0].records)

    @property
    def families(self) -> int:
        """Number of objects that these surfaces show."""
        return len(set(self.standings[0].families))

    @property
    def smallest(self) -> list[float]:
        """The smallest mean angle error on each surface."""
        return [min(column) for column in zip(*(s.angles for s in self.standings), strict=True)]

    @property
    def good(self) -> list[Standing]:
        """The algorithms that are as good as the best one on every surface, the fastest first."""
        kept = [s for s in self.standings if as_good(s.angles, self.smallest)]
        return sorted(kept, key=lambda s: s.seconds)

    def near(self, standing: Standing, share: float) -> list[bool]:
        """Return on which surfaces the angle error is within a share of the smallest."""
        pairs = zip(standing.angles, self.smallest, strict=True)
        return [own <= (1 + share) * least for own, least in pairs]


def field_of(evidence: Evidence, policy: str) -> Field | None:
    """Return the main algorithms that map to the disk, on the surfaces that all of them mapped.

    Those that mapped fewer than :data:`SHARE` of what others did are left out. None if there is no
    surface.
    """
    frame = evidence.frame
    disks = frame[(frame["target"] == DISK) & frame["main"] & (frame["solves"] == policy)]
    maps = disks[disks["ok"] & (disks["seconds"] > 0) & disks[ANGLE].notna()]
    keys = maps.pivot(index="place", columns="label", values="key")
    number = keys.notna().sum()
    series = [s for s in evidence.disk_series if s.main]
    chosen = [s for s in series if number.get(s.label, 0) >= SHARE * max(number, default=1)]
    common = keys[[s.label for s in chosen]].dropna()
    if common.empty:
        return None
    standings, rows = [], maps.set_index("key")
    for s in chosen:
        own = rows.loc[common[s.label]]
        angles = own[ANGLE].astype(float).clip(lower=FLOOR)
        families = tuple(own["family"])
        means = (_over_families(x.tolist(), families) for x in (angles, own["seconds"]))
        records = tuple(evidence.by_key[key] for key in own.index)
        standings.append(Standing(s, records, families, angles.tolist(), *means))
    left_out = tuple(s.label for s in series if s not in chosen)
    return Field(tuple(sorted(standings, key=lambda s: s.angle)), len(keys), left_out)


def _over_families(values: Sequence[float], families: Sequence[str]) -> float:
    """Return the geometric mean over families of the geometric means within them."""
    return exp(mean(family_means([log(value) for value in values], families)))


def compare_angles(other: Standing, best: Standing) -> AngleRatio:
    """Return the geometric mean over families of other / best, with its interval and the median."""
    ratios = [a / b for a, b in zip(other.angles, best.angles, strict=True)]
    logs = family_means([log(ratio) for ratio in ratios], best.families)
    interval = average_interval(ratios, best.families)
    return AngleRatio(exp(mean(logs)), exp(median(logs)), interval)


def compare_seconds(slower: Standing, faster: Standing) -> Comparison | None:
    """Compare two algorithms by the ratios of their seconds within rounds.

    With enough families the ratios of these decide, which is a statement on other families;
    otherwise the means over the surfaces in each round do, a statement on these surfaces.
    """
    ratios = [paired_ratios(a, b) for a, b in zip(slower.records, faster.records, strict=True)]
    rounds = min(map(len, ratios))
    if not rounds:
        return None
    if len(set(faster.families)) >= FEWEST_FAMILIES:
        logs = [median(map(log, found)) for found in ratios]
        return compare_ratios([exp(own) for own in family_means(logs, faster.families)])
    together = np.log([found[:rounds] for found in ratios]).mean(axis=0)
    return compare_ratios(np.exp(together).tolist())


def listed(names: Sequence[str]) -> str:
    """Return names as "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


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
        None if claims else declared_table(evidence, "own-surfaces"),
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
    told = [(policy, _rates(evidence, policy)) for policy in evidence.policies]
    here = "; ".join(f"{rates}{under(policy, evidence)}" for policy, (rates, _) in told)
    origins = Counter(surface.origin for surface in evidence.one_per_model)
    models, others = origins["model"], origins["stand-in"]
    over = [f"{models} of its models"] if models else []
    over += [f"{others} stand-in{'s' if others > 1 else ''}"] if others else []
    intervals = (
        "with 95 % intervals over models"
        if any(sure for _, (_, sure) in told)
        else f"too few for an interval ({DEFAULT_ROUNDS} rounds on {FEWEST_FAMILIES} models)"
    )
    return (
        f"{paper.reference.upper()} against {names}: printed {printed}; here {here}. This is "
        f"{paper.rate}, averaged over the models; here over {' and '.join(over)}, {intervals}."
    )


def _rates(evidence: Evidence, policy: str) -> tuple[str, bool]:
    """Return the measured averages as text, and whether one of them has an interval."""
    told, sure = [], False
    for algorithm in evidence.paper.compared:
        rates = list(measured_rates(evidence, algorithm, policy).values())
        series, interval = evidence.series_of(algorithm), None
        if rates and series is not None:
            rounds = paired_rounds(evidence, series, policy, evidence.one_per_model)
            interval = rate_interval([ratios for _, ratios, _ in rounds], log=False)
        between = f" ({interval.low:.1f} to {interval.high:.1f})" if interval else ""
        told.append(f"{MEAN_RATE.of(rates):.1f}{between}" if rates else "not measured")
        sure = sure or interval is not None
    return ", ".join(told), sure


def verdicts_counted(claims: Sequence[Claim]) -> Sentence:
    """Return the numbers of all verdicts, failing ones first and with links to their claims."""
    parts: list[str | Claim] = [f"Of {len(claims)} claims of the paper, "]
    for verdict, (one, several) in VERDICTS.items():
        found = [claim for claim in claims if claim.verdict == verdict]
        if found:
            parts.append(f"{'; ' if len(parts) > 1 else ''}{len(found)} ")
            parts.append(one if len(found) == 1 else several)
        for k, claim in enumerate(found if verdict in _NAMED else ()):
            parts += [", " if k else ": ", claim]
    return (*parts, ".")

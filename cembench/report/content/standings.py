"""Who has the smallest angle errors and who is the fastest, for one target: sentences and a table.

Each target is a contest of its own: a free boundary is easier than the disk. All of a contest is
over the surfaces that all of its algorithms mapped.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import exp, log
from statistics import mean, median
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cembench.core.names import slug
from cembench.report.content.evidence import ANGLE, AS_GOOD, DEGREES, DISK, Evidence
from cembench.report.declarations import own
from cembench.report.document import Finding, Plain, Table, Value, missing
from cembench.report.given_tables import given_table
from cembench.results.comparison import (
    Comparison,
    compare_ratios,
    middle_ratio,
    paired_ratios,
    verdict_of,
)
from cembench.results.families import (
    FEWEST_FAMILIES,
    average_interval,
    family_means,
    share_interval,
)
from cembench.results.frame import phrase
from cembench.results.intervals import Interval, share_of

if TYPE_CHECKING:
    import pandas as pd

#: An algorithm takes part with maps of at least this share of the surfaces that most mapped.
SHARE = 0.9
#: Smaller mean angle errors, in degrees, count as this: their ratios are of rounding.
FLOOR = 0.01
#: An angle error within this share of the smallest one of a surface counts as equal to it.
NEAR = 0.01
#: How the sentence on a target begins, before the surfaces, and the title of its table.
_TARGETS: Mapping[str, tuple[str, str]] = {
    DISK: ("On", "Maps to the disk"),
    "free boundary": ("With a free boundary, on", "Maps with a free boundary"),
    "circular holes": ("To the disk with circular holes, on", "Maps to circular holes"),
    "atlas": ("As atlases, on", "Atlases"),
}


def title_of(target: str) -> str:
    """Return what the maps to a target are called.

    >>> title_of("free boundary")
    'Maps with a free boundary'
    """
    return _TARGETS.get(target, ("", target))[1]


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


def contest_of(evidence: Evidence, policy: str, target: str = DISK) -> dict[str, Any]:
    """Compare the main algorithms of a target, on the surfaces that all of them mapped.

    Those that mapped fewer than :data:`SHARE` of what others did are `absent`. The names are those
    of `findings.toml`; empty if there is no surface. `order` has the smallest angle errors first,
    `alike` the algorithms that are as good as the best on every surface, `good` those of them that
    were timed, the fastest first; the maps of the `untimed` were read from files.
    """
    frame = evidence.frame
    rows = frame[(frame["target"] == target) & frame["main"] & (frame["solves"] == policy)]
    # An angle error to which the surface was fitted decides nothing.
    given = rows["external"] == "maps"
    usable = ~rows["fitted"] & ((rows["seconds"] > 0) | given) & rows[ANGLE].notna()
    maps = rows[rows["ok"] & usable]
    if maps.empty:
        return {}
    wide = maps.pivot(index="place", columns="label", values=["key", ANGLE, "seconds"])
    number = wide["key"].notna().sum()
    tried = [s.label for s in evidence.series_to(target) if s.main]
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
    alike = [one for one in order if as_good(angles[one], least)]
    untimed = {*rows["label"][given]}
    good = [one for one in alike if one not in untimed]
    good.sort(key=lambda one: _over_families(seconds[one], families).mean)
    against = {one: _over_families(angles[one] / angles[best], families) for one in others}
    sure = {o for o, speeds in against.items() if speeds.interval and speeds.interval.low > 1}
    first = keys[good[0]] if good else None
    speeds = {
        one: None if first is None else _speeds(evidence, keys[one], first, families)
        for one in order
    }
    start, title = _TARGETS.get(target, (f"{target}, on", ""))[0], title_of(target)
    few = len(set(families)) < FEWEST_FAMILIES
    known: dict[str, Any] = {
        **{"target": target, "start": start, "title": title, "policy": policy},
        **{"order": order, "best": best, "others": others, "good": good, "means": means},
        **{"n": len(common), "surfaces": len(wide), "families": len(set(families)), "few": few},
        **{"absent": [one for one in tried if one not in chosen], "times": AS_GOOD},
        "fitted": set(rows["label"][rows["fitted"]]),
        **{"worse": [one for one in order if one not in alike], "degrees": DEGREES},
        **{"alike": alike, "untimed": untimed},
        **{"names": listed, "surfaces_words": surfaces_words, "against": against},
        **{"speeds": speeds, "within": f"{100 * NEAR:.0f}", "ended": _ended(rows)},
    }
    known["smallest"], known["nearly"] = (
        {one: _share(angles[one] <= (1 + near) * least, families, few) for one in order}
        for near in (0, NEAR)
    )
    if others:
        unsure = [one for one in others if one not in sure]
        known |= {"second": others[0], "sure": others[0] in sure, "unsure": unsure}
        known |= {"equal": [one for one in unsure if one in alike]}
        known |= {"ratio": against[others[0]].mean, "interval": against[others[0]].interval}
    fastest = speeds[good[1]] if len(good) > 1 else None
    known |= {"verdict": fastest and fastest.verdict, "speed_ratio": fastest and fastest.ratio}
    for name, cases in own("findings.toml").items():
        if others or name != "head":
            known[name] = phrase(cases, frame, known)
    return known


def _ended(rows: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """Return for each algorithm how many of its cells have a valid map, and how many it has."""
    ok = rows.groupby("label")["ok"]
    return {str(label): (int(one.sum()), len(one)) for label, one in ok}


def _share(held: pd.Series, families: Sequence[str], few: bool) -> Value:
    """Return for how many surfaces something holds, or for which share of families."""
    if few:
        return Value(f"{int(held.sum())} of {len(held)}", float(held.sum()), "derived")
    share = mean(family_means(held.tolist(), families))
    between = share_interval(share, len(set(families)))
    text = f"{100 * share:.0f} % ({100 * between.low:.0f} to {100 * between.high:.0f})"
    return Value(text, share, "derived")


def _over_families(values: Sequence[float], families: Sequence[str]) -> Over:
    """Return the geometric mean over families of the geometric means within them."""
    logs = family_means([log(value) for value in values], families)
    return Over(exp(mean(logs)), exp(median(logs)), average_interval(values, families))


def _speeds(
    evidence: Evidence, slower: Sequence[str], faster: Sequence[str], families: Sequence[str]
) -> Comparison | None:
    """Compare two algorithms by the ratios of their seconds within rounds, given their records.

    With enough families their geometric mean decides, which is a statement on other families;
    otherwise the means over the surfaces in each round do, a statement on these surfaces. Surfaces
    on which they share no round are left out.
    """
    pairs = [(evidence.by_key[a], evidence.by_key[b]) for a, b in zip(slower, faster, strict=True)]
    if slower is faster or all(a is b for a, b in pairs):
        return None
    paired = [paired_ratios(a, b) for a, b in pairs]
    families = [family for family, ratios in zip(families, paired, strict=True) if ratios]
    ratios = list(filter(None, paired))
    if not ratios:
        return None
    if len(set(families)) >= FEWEST_FAMILIES:
        middles = list(map(middle_ratio, ratios))
        over = _over_families(middles, families)
        return Comparison(over.mean, over.interval, verdict_of(over.interval), len(ratios))
    rounds = min(map(len, ratios))
    share = share_of(rounds, *(record.cell for pair in pairs for record in pair))
    together = np.log([ratio[:rounds] for ratio in ratios]).mean(axis=0)
    return compare_ratios(np.exp(together).tolist(), share)


def contests_of(evidence: Evidence, policy: str) -> list[dict[str, Any]]:
    """Return the contests of a run, or, without any, what one algorithm mapped; see above."""
    made = [contest_of(evidence, policy, target) for target in evidence.targets]
    known = [one for one in made if one]
    return [one for one in known if one["others"]] or known[:1]


def standings(contest: Mapping[str, Any]) -> Table:
    """Return the algorithms of a contest in a row each, the smallest angle errors first."""
    good = contest["good"]
    rows = list(_ranked(contest))
    fitted, few = "stand-ins were fitted to its angle errors", "too few valid maps to be compared"
    rows += [
        [label, _of(contest, label), *[missing(fitted if label in contest["fitted"] else few)] * 5]
        for label in contest["absent"]
    ]
    name = "standings" if contest["target"] == DISK else f"standings-{slug(contest['target'])}"
    alike = len(contest["alike"])
    fastest = f"The fastest is {good[0]}" if good else "None was timed"
    if len(good) == 1 < alike:
        fastest = f"Only {good[0]} was timed"
    texts = {
        "time": f"time over {good[0]}'s" if good else "time",
        "fastest": fastest,
        "but": "" if alike > 1 else " No other is about as good.",
        "fewest": FEWEST_FAMILIES,
    }
    return given_table("standings", rows, {**contest, **texts}, called=name)


def rank_tables(contests: Sequence[Mapping[str, Any]]) -> list[Table]:
    """Return the table of each contest with several algorithms."""
    return [standings(one) for one in contests if one["others"]]


def _of(contest: Mapping[str, Any], label: str) -> Value:
    ok, tried = contest["ended"].get(label, (0, 0))
    return Value(f"{ok} of {tried}", float(ok), "derived")


def _ranked(contest: Mapping[str, Any]) -> Iterator[list[Plain]]:
    for label in contest["order"]:
        over, speed = contest["against"].get(label), contest["speeds"][label]
        yield [
            *(label, _of(contest, label), contest["means"][label]),
            _ratio(over.mean, over.interval, ".3f") if over else Value("1", 1.0, "derived"),
            *(contest["smallest"][label], contest["nearly"][label]),
            Value("1", 1.0, "derived")
            if label in contest["good"][:1]
            else _ratio(speed.ratio, speed.interval, ".2f")
            if speed
            else missing(
                "the maps were read from files"
                if label in contest["untimed"]
                else "no round with both"
            ),
        ]


def _ratio(ratio: float, interval: Interval | None, form: str) -> Value:
    between = f" ({interval.low:{form}} to {interval.high:{form}})" if interval else ""
    return Value(f"{ratio:{form}}{between}", ratio, "derived")


def contest_words(contest: Mapping[str, Any]) -> str:
    """Return sentences on whose angle errors are the smallest, and who is the fastest."""
    return " ".join(contest[name] for name in ("angles", "fastest") if contest[name])


def contest_figures(contest: Mapping[str, Any]) -> list[Finding]:
    """Return the key figures: the fastest against the next, and the best angles."""
    figures = [Finding(f"{contest['means'][contest['best']]:.2f}°", contest["angle"])]
    if contest["speed"]:
        figures.insert(0, Finding(f"{contest['speed_ratio']:.2f} times", contest["speed"]))
    return figures


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names as "a, b and c"."""
    return f" {last} ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def surfaces_words(surfaces: int, families: int) -> str:
    """Return a number of surfaces, and of the families that they are of if these are fewer."""
    return f"{surfaces} surfaces" + (f" of {families} families" if families < surfaces else "")

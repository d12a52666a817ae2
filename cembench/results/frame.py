"""Expressions over a run's frame, one row a record: what declared tables and claims are made of.

An expression is Python over the frame's columns (:mod:`cembench.results.columns`) and these
functions, e.g. ``median(angle_error_mean_deg[ok])``. Nothing else can be named in one, so that a
declaration reads a run and does nothing else; a paper adds the functions of its own folder.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cembench.core.errors import ParameterError
from cembench.core.names import did_you_mean
from cembench.results.columns import significant
from cembench.results.expressions import computed, names_in
from cembench.results.families import (
    average_interval,
    family_geometric,
    family_means,
    rate_interval,
    share_interval,
    votes,
)
from cembench.results.multiple_testing import corrected, geometric, sign_test

if TYPE_CHECKING:
    import pandas as pd

    #: What expressions are over; without columns where all they name is given.
    Frame: TypeAlias = pd.DataFrame | Mapping[str, Any]

_NOTHING: Mapping[str, Any] = MappingProxyType({})
#: Maximum number of entries that :func:`commonest` names.
_NAMED = 3
#: Maximum number of surfaces of a sign test, which computes with whole numbers of as many bits.
_MOST_TESTED = 10_000


def _count(of: pd.Series) -> int:
    """Return how many are true, or, of figures, how many there are."""
    return int(of.sum() if of.dtype == bool else of.notna().sum())


def _shares(of: pd.Series, families: pd.Series | None) -> list[float]:
    """Return the share of each family; each entry is one of its own if there are none."""
    held = of if of.dtype == bool else of.notna()
    return family_means(list(held), list(range(len(held)) if families is None else families))


def _share(of: pd.Series, families: pd.Series | None = None) -> float:
    return 100 * float(np.mean(_shares(of, families)))


def _share_words(of: pd.Series, families: pd.Series | None = None) -> str:
    shares = _shares(of, families)
    interval = share_interval(float(np.mean(shares)), len(shares))
    return f"{100 * interval.low:.1f} to {100 * interval.high:.1f}"


def _family_percentile(of: pd.Series, families: pd.Series, q: float) -> float | None:
    """Return a percentile of surfaces that weigh as much as their family divided among them."""
    known = of.notna()
    if not known.any():
        return None
    values, own = of[known].astype(float).to_numpy(), families[known]
    weights = 1 / own.map(own.value_counts()).to_numpy()
    return float(np.percentile(values, q, weights=weights, method="inverted_cdf"))


def _at_largest(of: pd.Series, wanted: pd.Series) -> Any:
    return wanted.loc[of.astype(float).idxmax()] if of.notna().any() else None


def _at_median(of: pd.Series, wanted: pd.Series) -> Any:
    """Return the entry at the median of figures, the lower of two."""
    ordered = of.dropna().astype(float).sort_values(kind="stable")
    return wanted.loc[ordered.index[(len(ordered) - 1) // 2]] if len(ordered) else None


def commonest(of: pd.Series) -> str:
    """Return the commonest entries of lists with their numbers: "folded 2, timeout 1"."""
    counts = Counter(kind for kinds in of for kind in kinds)
    named = ", ".join(f"{k.replace('_', ' ')} {n}" for k, n in counts.most_common(_NAMED))
    return named or "none"


def listed(before: str, texts: Iterable[object], after: str = "", between: str = "; ") -> str:
    """Return texts in a row between two others, or nothing if there are none.

    >>> listed("; not on ", ["a", "b"], between=", ")
    '; not on a, b'
    """
    joined = between.join(map(str, texts))
    return f"{before}{joined}{after}" if joined else ""


def _corrected(of: pd.Series) -> pd.Series:
    """Return the verdicts of comparisons that are all right together."""
    import pandas as pd

    return pd.Series([one.verdict for one in corrected(list(of))], index=of.index)


def _wins(of: pd.Series, families: pd.Series) -> tuple[int, int]:
    """Return for how many families most ratios are above 1, and below."""
    return votes([1.0] * len(of), list(of), list(families))


def _family_geometric(of: pd.Series, families: pd.Series) -> float | None:
    known = of.dropna()
    return family_geometric(list(known), list(families[known.index])) if len(known) else None


def _family_interval(of: pd.Series, families: pd.Series) -> str | None:
    known = of.dropna()
    interval = average_interval(list(known), list(families[known.index]))
    return f"{interval.low:.2f} to {interval.high:.2f}" if interval else None


def _rate_interval(of: pd.Series, families: pd.Series) -> str | None:
    interval = rate_interval(list(1 + of), list(families), log=False)
    return f"{interval.low:.1f} to {interval.high:.1f}" if interval else None


def _sign_test(wins: int, losses: int) -> float:
    if wins + losses > _MOST_TESTED:
        raise ValueError(f"the sign test is of {_MOST_TESTED:,} surfaces at most")
    return sign_test(wins, losses)


def _percentile(known: Any, q: float) -> float:
    return float(np.percentile(known, q))


def _figure(of: Callable[..., Any]) -> Callable[..., float | None]:
    def computed(column: pd.Series, *more: Any) -> float | None:
        known = column.dropna().astype(float).to_numpy()
        return float(of(known, *more)) if len(known) else None

    return computed


FUNCTIONS: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {
        "count": _count,
        "families": lambda of: of.nunique(),
        "share": _share,
        "share_interval": _share_words,
        "family_percentile": _family_percentile,
        "family_geometric": _family_geometric,
        "family_interval": _family_interval,
        "rate_interval": _rate_interval,
        "wins": _wins,
        "corrected": _corrected,
        "mean": _figure(np.mean),
        "median": _figure(np.median),
        "percentile": _figure(_percentile),
        "smallest": _figure(np.min),
        "largest": _figure(np.max),
        "at_least": lambda of, least: of.clip(lower=least),
        "geometric": _figure(geometric),
        "geometric_rate": _figure(lambda rates: geometric(1 + rates) - 1),
        "at_largest": _at_largest,
        "at_median": _at_median,
        "first": lambda of: of.iloc[0] if len(of) else None,
        "commonest": commonest,
        "total": lambda of: of.sum(),
        "setting": lambda of, name: of.map(lambda parameters: parameters.get(name)),
        "listed": listed,
        "significant": lambda number, digits=3: significant(number, min(digits, 17)),
        "sign_test": _sign_test,
        "len": len,
        "min": min,
        "max": max,
        "abs": abs,
    }
)


def evaluate(expression: str, frame: Frame, more: Mapping[str, Any] = _NOTHING) -> Any:
    """Return the value of an expression over a frame; `more` names what else is known in it.

    Raises
    ------
    ParameterError
        The expression cannot be read, names something unknown, or fails on this frame.
    """
    known = {**FUNCTIONS, **more}
    for name in names_in(expression):
        if name in frame and name not in more:
            known[name] = frame[name]
        elif name not in known:
            columns = sorted({str(column) for column in frame} - more.keys())
            raise ParameterError(unknown(expression, name, columns, more))
    return computed(expression, known)


def unknown(expression: str, name: str, columns: Iterable[str], more: Iterable[str]) -> str:
    """Return what to say of an unknown name in an expression: the nearest ones, then all."""
    columns, functions = list(columns), [*FUNCTIONS, *more]
    near = did_you_mean(name, [*functions, *columns])
    return (
        f"{expression!r} names {name!r}, which is not known.{near} Functions: "
        f"{', '.join(functions)}. Columns: {', '.join(columns)}."
    )


def filled(text: str, frame: Frame, more: Mapping[str, Any] = _NOTHING) -> str:
    """Return a text with expressions in braces replaced by their values, as in an f-string.

    Raises
    ------
    ParameterError
        As for :func:`evaluate`.
    """
    # The space keeps a quotation mark at the end apart from those around.
    return str(evaluate(f'f"""{text} """', frame, more))[:-1]


def phrase(cases: Iterable[Mapping[str, str]], frame: Frame, more: Mapping[str, Any]) -> str:
    """Return the words of the first case whose condition `when`, if any, holds; "" without one.

    >>> cases = [{"when": "n == 1", "words": "one surface"}, {"words": "{n} surfaces"}]
    >>> phrase(cases, {}, {"n": 3})
    '3 surfaces'
    """
    for case in cases:
        if "when" not in case or evaluate(case["when"], frame, more):
            return filled(case["words"], frame, more)
    return ""

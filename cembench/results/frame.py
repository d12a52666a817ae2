"""Expressions over a run's frame, one row a record: what declared tables and claims are made of.

An expression is Python over the frame's columns (:mod:`cembench.results.columns`) and these
functions, e.g. ``median(angle_error_mean_deg[ok])``. Nothing else can be named in one, so that a
declaration reads a run and does nothing else; a paper adds the functions of its own folder.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from types import CodeType, MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from cembench.core.errors import ParameterError
from cembench.results.columns import significant
from cembench.results.intervals import LEVEL
from cembench.results.multiple_testing import geometric, sign_test

if TYPE_CHECKING:
    import pandas as pd

_NOTHING: Mapping[str, Any] = MappingProxyType({})
#: Maximum number of entries that :func:`commonest` names.
_NAMED = 3
#: What a value may be asked for: everything else of a column is out of reach.
_METHODS = frozenset(
    {"isin", "isna", "notna", "str", "startswith", "endswith", "contains", "abs", "len"}
)


def share_interval(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % Wilson interval of a share.

    >>> [round(end, 3) for end in share_interval(10, 10)]
    [0.722, 1.0]
    """
    from scipy.stats import binomtest  # slow to import

    found = binomtest(successes, n).proportion_ci(LEVEL, method="wilson")
    return float(found.low), float(found.high)


def _count(of: pd.Series) -> int:
    """Return how many are true, or, of figures, how many there are."""
    return int(of.sum() if of.dtype == bool else of.notna().sum())


def _share_words(of: pd.Series) -> str:
    low, high = share_interval(int(of.sum()), len(of))
    return f"{100 * low:.1f} to {100 * high:.1f}"


def _at_largest(of: pd.Series, wanted: pd.Series) -> Any:
    return wanted.loc[of.astype(float).idxmax()] if of.notna().any() else None


def commonest(of: pd.Series) -> str:
    """Return the commonest entries of lists with their numbers: "folded 2, timeout 1"."""
    found = Counter(kind for kinds in of for kind in kinds)
    named = ", ".join(f"{k.replace('_', ' ')} {n}" for k, n in found.most_common(_NAMED))
    return named or "none"


def listed(before: str, texts: Iterable[object], after: str = "", between: str = "; ") -> str:
    """Return texts in a row between two others, or nothing if there are none.

    >>> listed("; not on ", ["a", "b"], between=", ")
    '; not on a, b'
    """
    found = between.join(map(str, texts))
    return f"{before}{found}{after}" if found else ""


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
        "share": lambda of: 100 * _count(of) / len(of),
        "share_interval": _share_words,
        "mean": _figure(np.mean),
        "median": _figure(np.median),
        "percentile": _figure(_percentile),
        "smallest": _figure(np.min),
        "largest": _figure(np.max),
        "geometric": _figure(geometric),
        "at_largest": _at_largest,
        "first": lambda of: of.iloc[0] if len(of) else None,
        "commonest": commonest,
        "total": lambda of: of.sum(),
        "setting": lambda of, name: of.map(lambda parameters: parameters.get(name)),
        "listed": listed,
        "significant": significant,
        "sign_test": sign_test,
        "len": len,
        "min": min,
        "max": max,
        "abs": abs,
    }
)


def evaluate(expression: str, frame: pd.DataFrame, more: Mapping[str, Any] = _NOTHING) -> Any:
    """Return the value of an expression over a frame; `more` names what else is known in it.

    Raises
    ------
    ParameterError
        The expression cannot be read, names something unknown, or fails on this frame.

    """
    code, names = _compiled(expression)
    known = {**FUNCTIONS, **more}
    for name in names:
        if name in frame and name not in more:
            known[name] = frame[name]
        elif name not in known:
            columns = sorted({str(column) for column in frame} - more.keys())
            raise ParameterError(
                f"{expression!r} names {name!r}; known are the functions "
                f"{', '.join((*FUNCTIONS, *more))} and the columns {', '.join(columns)}."
            )
    try:
        return eval(code, {"__builtins__": {}}, known)
    except Exception as error:
        raise ParameterError(f"{expression!r} fails on this run: {error}.") from error


@cache
def _compiled(expression: str) -> tuple[CodeType, tuple[str, ...]]:
    """Return the code of an expression, and the names in it."""
    try:
        tree = ast.parse(expression, mode="eval")
    except SyntaxError as error:
        raise ParameterError(f"{expression!r} is no expression: {error.msg}.") from error
    nodes = list(ast.walk(tree))
    for node in nodes:
        if isinstance(node, ast.Attribute) and node.attr not in _METHODS:
            raise ParameterError(
                f"{expression!r} asks for {node.attr!r}; allowed are {', '.join(sorted(_METHODS))}."
            )
        if isinstance(node, ast.Lambda | ast.ListComp | ast.GeneratorExp | ast.NamedExpr):
            raise ParameterError(f"{expression!r} is more than an expression over columns.")
    names = dict.fromkeys(node.id for node in nodes if isinstance(node, ast.Name))
    return compile(tree, "<declaration>", "eval"), tuple(names)


def filled(text: str, frame: pd.DataFrame, more: Mapping[str, Any] = _NOTHING) -> str:
    """Return a text with expressions in braces replaced by their values, as in an f-string.

    Raises
    ------
    ParameterError
        As for :func:`evaluate`.

    """
    # The space keeps a quotation mark at the end apart from those around.
    return str(evaluate(f'f"""{text} """', frame, more))[:-1]

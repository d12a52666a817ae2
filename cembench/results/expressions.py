"""Expressions of declarations: checked before they are run, and bounded while they are.

A declaration may come from anybody, so an expression reads values and computes with them, and
nothing else: it has a length, a depth and kinds of parts, its operators make nothing huge, and it
has so many seconds. What names in it stand for is the caller's (:mod:`cembench.results.frame`).
"""

from __future__ import annotations

import ast
import operator
import re
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from string import Formatter
from types import CodeType
from typing import Any, NoReturn

from cembench.core.errors import ParameterError

#: Most characters of an expression, and parts of it within each other; ours have 661 and 12.
MAX_CHARACTERS, MAX_DEPTH = 4000, 40
#: Most characters or entries, bits of a whole number, and digits of a width or precision.
MAX_LENGTH, MAX_BITS, MAX_DIGITS = 100_000, 1024, 3
#: CPU seconds that an expression may take, with the functions of a paper's folder that it calls.
MAX_SECONDS = 120.0
#: What a value may be asked for: everything else of a column is out of reach.
METHODS = frozenset(
    {"isin", "isna", "notna", "str", "startswith", "endswith", "contains", "abs", "len"}
)
#: What an expression consists of; contexts and operators are parts, too.
_PARTS = (
    *(ast.Expression, ast.Constant, ast.Name, ast.Load, ast.Attribute, ast.Subscript, ast.Slice),
    *(ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Call, ast.keyword),
    *(ast.List, ast.Tuple, ast.Starred, ast.JoinedStr, ast.FormattedValue),
    *(ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.Mod, ast.Pow, ast.BitAnd, ast.BitOr),
    *(ast.unaryop, ast.boolop, ast.cmpop),
)


def computed(expression: str, known: Mapping[str, Any]) -> Any:
    """Return the value of an expression; `known` has all :func:`names_in` it.

    Raises
    ------
    ParameterError
        The expression cannot be read, is more than one, fails, or takes too long or too much.
    """
    code, _ = _compiled(expression)
    try:
        with _within(MAX_SECONDS):
            return _bounded(eval(code, {"__builtins__": {}, **_OPERATORS}, dict(known)))
    except Exception as error:
        raise ParameterError(f"{_shown(expression)} fails on this run: {error}.") from error


def names_in(expression: str, *, text: bool = False) -> tuple[str, ...]:
    """Return the names in an expression, or in the braces of a text; raises as `computed` does."""
    return _compiled(f'f"""{expression} """' if text else expression)[1]


@cache
def _compiled(expression: str) -> tuple[CodeType, tuple[str, ...]]:
    """Return the code of an expression, with bounded operators, and the names in it."""
    shown = _shown(expression)
    if len(expression) > MAX_CHARACTERS:
        raise ParameterError(
            f"{shown} has {len(expression):,} characters; allowed are {MAX_CHARACTERS:,}. What "
            "needs more is a function of checks.py."
        )
    try:
        tree = ast.parse(expression, mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = getattr(error, "msg", None) or "it cannot be parsed"
        raise ParameterError(f"{shown} is no expression: {why}.") from error
    names: dict[str, None] = {}
    for node in _nodes(tree, shown):
        if isinstance(node, ast.Attribute) and node.attr not in METHODS:
            raise ParameterError(
                f"{shown} asks for {node.attr!r}; allowed are {', '.join(sorted(METHODS))}."
            )
        if not isinstance(node, _PARTS) or _is_wide(node):
            part = "a width" if isinstance(node, ast.FormattedValue) else type(node).__name__
            raise ParameterError(f"{shown} is more than an expression over columns: it has {part}.")
        if isinstance(node, ast.Name):
            names[node.id] = None
    bounded = ast.fix_missing_locations(_Bounded().visit(tree))
    return compile(bounded, "<declaration>", "eval"), tuple(names)


def _nodes(tree: ast.AST, shown: str) -> Iterator[ast.AST]:
    """Yield the parts of an expression, from the outside inwards."""
    level, depth = [tree], 0
    while level:
        yield from level
        level, depth = [part for node in level for part in ast.iter_child_nodes(node)], depth + 1
        if depth > MAX_DEPTH:
            raise ParameterError(f"{shown} has parts within parts, more than {MAX_DEPTH} deep.")


def _is_wide(node: ast.AST) -> bool:
    """Whether this is a format of another width than a few digits."""
    if not isinstance(node, ast.FormattedValue) or node.format_spec is None:
        return False
    parts = node.format_spec.values if isinstance(node.format_spec, ast.JoinedStr) else []
    fixed = [str(part.value) for part in parts if isinstance(part, ast.Constant)]
    return len(fixed) < len(parts) or _has_many_digits("".join(fixed))


def _has_many_digits(form: str) -> bool:
    return any(len(digits) > MAX_DIGITS for digits in re.findall(r"\d+", form))


def with_words(text: str, *values: object, **known: object) -> str:
    """Return a text with plain names or places in braces replaced, as by ``str.format``.

    Raises
    ------
    ValueError
        Braces hold more than a name with a format of a few digits.
    LookupError
        A name stands for nothing.

    >>> with_words("{n:,} triangles of {}", "hand", n=5000)
    '5,000 triangles of hand'
    """
    for _, name, form, _ in Formatter().parse(text):
        wide = form and ("{" in form or _has_many_digits(form))
        if wide or (name and not (name.isidentifier() or name.isdigit())):
            raise ValueError(f"{{{name}}} is more than a name with a format of a few digits")
    return text.format(*values, **known)


class _Bounded(ast.NodeTransformer):
    """Has bounded functions compute what could be huge."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Replace an operator by the call of its function."""
        self.generic_visit(node)
        name = f" {type(node.op).__name__}"  # no expression can name it
        if name not in _OPERATORS:
            return node
        return ast.Call(ast.Name(name, ast.Load()), [node.left, node.right], [])


def _power(a: Any, b: Any) -> Any:
    if isinstance(a, int) and isinstance(b, int):
        _check(a.bit_length() * abs(b), MAX_BITS, "bits")
    return a**b


def _times(a: Any, b: Any) -> Any:
    for one, other in ((a, b), (b, a)):
        if isinstance(one, str | list | tuple) and isinstance(other, int):
            _check(len(one) * other, MAX_LENGTH, "characters or entries")
    return a * b


def _modulo(a: Any, b: Any) -> Any:
    if isinstance(a, str | bytes):
        raise ValueError("% is for numbers; texts are written as f'{value}'")
    return a % b


def _checked(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    return lambda a, b: _bounded(function(_bounded(a), _bounded(b)))


_OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    f" {kind.__name__}": _checked(function)
    for kind, function in (
        (ast.Pow, _power),
        (ast.Mult, _times),
        (ast.Mod, _modulo),
        (ast.Add, operator.add),
    )
}


def _bounded(value: Any) -> Any:
    """Return a value that is not huge."""
    if isinstance(value, int):
        _check(value.bit_length(), MAX_BITS, "bits")
    elif isinstance(value, str | list | tuple):
        _check(len(value), MAX_LENGTH, "characters or entries")
    return value


def _check(size: int, most: int, what: str) -> None:
    if size > most:
        raise ValueError(f"a value of it has {size:,} {what}; allowed are {most:,}")


@contextmanager
def _within(seconds: float) -> Iterator[None]:
    """Raise after this many CPU seconds, where the system can and no other such limit is set."""

    def late(*_: object) -> NoReturn:
        raise TimeoutError(f"it takes more than {seconds:g} s of CPU time")

    in_main = threading.current_thread() is threading.main_thread()
    if not (in_main and hasattr(signal, "setitimer")) or any(signal.getitimer(_CLOCK)):
        yield
        return
    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(_CLOCK, seconds)
    try:
        yield
    finally:
        signal.setitimer(_CLOCK, 0)
        signal.signal(signal.SIGVTALRM, before)


#: It counts what this process computes, however busy the machine is; Windows has none.
_CLOCK = getattr(signal, "ITIMER_VIRTUAL", 0)


def _shown(expression: str) -> str:
    return repr(expression if len(expression) <= 300 else f"{expression[:300]}...")

"""Checks of output paths, made before any work is done."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from cembench.core.errors import ParameterError


def refuse_inputs(output: Path, inputs: Iterable[Path], *, force: bool) -> None:
    """Raise :class:`ParameterError` if an output is also an input, unless forced.

    Symbolic and hard links to an input count as the input.
    """
    for source in inputs:
        if not force and output.exists() and source.exists() and output.samefile(source):
            raise ParameterError(
                f"the output {output} is the input {source}. Name another path, or add "
                "`overwrite` to replace it."
            )


def refuse_twice(outputs: Sequence[Path], what: str, remedy: str) -> None:
    """Raise :class:`ParameterError` if two of `what` have the same path; `remedy` says what to do.

    >>> from pathlib import Path
    >>> refuse_twice([Path("a.obj"), Path("b.obj")], "surfaces", "Name two folders.")
    """
    places = [output.resolve() for output in outputs]
    for output, place in zip(outputs, places, strict=True):
        if places.count(place) > 1:
            raise ParameterError(f"two {what} would be written to {output}. {remedy}")


def refuse_present(outputs: Iterable[Path], *, force: bool) -> None:
    """Raise :class:`ParameterError` if one of several outputs exists, unless forced."""
    for output in outputs:
        if not force and (output.exists() or output.is_symlink()):
            raise ParameterError(
                f"{output} already exists. Name another path, or add `overwrite` to replace it."
            )

"""Checks of output paths, made before any work is done."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cembench.core.errors import ParameterError


def refuse_inputs(output: Path, inputs: Iterable[Path], *, force: bool) -> None:
    """Raise :class:`ParameterError` if an output is also an input, unless forced.

    Symbolic and hard links to an input count as the input.
    """
    for source in inputs:
        if not force and output.exists() and source.exists() and output.samefile(source):
            raise ParameterError(
                f"the output {output} is the input {source}. Name another path, or add --force to "
                "overwrite it."
            )


def refuse_existing(output: Path, *, overwrite: bool) -> None:
    """Raise :class:`ParameterError` if an output exists and may not be replaced."""
    if output.exists() and not overwrite:
        raise ParameterError(
            f"{output} already exists. Name another path, or pass overwrite=True to replace it."
        )


def refuse_present(outputs: Iterable[Path], *, force: bool) -> None:
    """Raise :class:`ParameterError` if one of several derived output files exists, unless forced.

    Derived names are built from names that the user gave.
    """
    for output in outputs:
        if not force and (output.exists() or output.is_symlink()):
            raise ParameterError(
                f"{output} already exists. Name another path with -o, or add --force to "
                "overwrite it."
            )

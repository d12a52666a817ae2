"""Checks of the places that a user names for output, before any work is done."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cembench.core.errors import ParameterError


def refuse_inputs(output: Path, inputs: Iterable[Path], *, force: bool) -> None:
    """Raise :class:`ParameterError` where an output is an input, by whatever name; not if forced.

    Symbolic and hard links to an input are the input.
    """
    for source in inputs:
        if not force and output.exists() and source.exists() and output.samefile(source):
            raise ParameterError(
                f"the output {output} is the input {source}. Name another place, or add --force to "
                "write over it."
            )


def refuse_existing(output: Path, *, overwrite: bool) -> None:
    """Raise :class:`ParameterError` where an output is there already; not if it may be replaced."""
    if output.exists() and not overwrite:
        raise ParameterError(
            f"{output} is there already. Name another place, or pass overwrite=True to replace it."
        )


def refuse_present(outputs: Iterable[Path], *, force: bool) -> None:
    """Raise :class:`ParameterError` where a file is in the way of one that the user did not name.

    Such names are made from those that the user gave.
    """
    for output in outputs:
        if not force and (output.exists() or output.is_symlink()):
            raise ParameterError(
                f"{output} is there already. Name another place with -o, or add --force to write "
                "over it."
            )

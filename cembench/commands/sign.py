"""The verb that signs a run, and the option that asks for signatures."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from cembench.commands.console import err, out

RequireSigned = Annotated[
    Path | None,
    typer.Option(
        "--require-signed",
        metavar="SIGNERS",
        help="Refuse runs not signed by somebody in this file (ssh-keygen: ALLOWED SIGNERS).",
    ),
]


def sign(
    run: Annotated[Path, typer.Argument(help="The run's folder.")],
    *,
    key: Annotated[Path, typer.Option("--key", help="Your SSH key.")],
) -> None:
    """Sign a run with your SSH key, so that others know who measured it.

    The signature is in RUN/signature, over all its files; sign again after the
    run has changed. `merge` and `publish` check it with --require-signed.
    """
    from cembench.results.signing import sign as signed

    out.print(f"signed: {signed(run, key.expanduser())}", soft_wrap=True)


def check_signed(runs: Iterable[Path], signers: Path | None) -> dict[Path, str]:
    """Return who signed each run, and print it; raise if one is not as ``--require-signed`` asks.

    Without that, nothing is known.
    """
    from cembench.results.signing import signer

    found = {} if signers is None else {run: signer(run, signers) for run in runs}
    for run, name in found.items():
        err.print(f"{run}: signed by {name}", markup=False, style="dim", soft_wrap=True)
    return found


#: Each verb with the examples that its help shows.
VERBS = ((sign, "Example:  cembench sign results/may --key ~/.ssh/id_ed25519"),)

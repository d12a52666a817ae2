"""Arguments and options that several commands share and no function of the API has."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

DEFAULT_RUN = Path("results/run")
Run = Annotated[Path, typer.Argument(help="A run's folder.")]
AddTo = Annotated[
    Path, typer.Option("--run", "-o", "--output", help="Add the exhibits to this run.")
]
OutputRun = Annotated[
    Path, typer.Option("-o", "--output", help="The run's folder; an existing run is resumed.")
]
Meshes = Annotated[
    list[Path], typer.Option("--mesh", metavar="PATH", help="A mesh file. Repeatable.")
]
Surfaces = Annotated[
    list[str],
    typer.Option("--surfaces", metavar="NAME", help="Generated surfaces, comma-separated."),
]
Force = Annotated[
    bool, typer.Option("--force", "--overwrite", help="Overwrite the input, or existing files.")
]
Verify = Annotated[
    bool, typer.Option("--verify", help="Recompute the figures of all maps, not just of a sample.")
]
Junit = Annotated[
    Path | None,
    typer.Option(
        "--junit", metavar="FILE", help="Write the checks as JUnit's XML, for test viewers."
    ),
]

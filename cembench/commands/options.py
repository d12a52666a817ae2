"""Options that several commands share and no function of the API has."""

from __future__ import annotations

from typing import Annotated

import typer

from cembench.api.settings import MOST_FACES

#: Each surface has its own, narrower bounds.
Faces = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_FACES, help="Number of triangles of generated surfaces."),
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Measure again what is already recorded.")]
Verify = Annotated[
    bool,
    typer.Option("--verify", help="Recompute the figures of all maps, not just of a sample."),
]

"""The command `morph`: morph surfaces into each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, complain, out, print_json, print_pair, split
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Force
from cembench.core.errors import AlgorithmFailed

from .morph import morph as morph_surfaces

Surfaces = Annotated[
    list[str], typer.Argument(help="Two or more mesh files, or names from `list surfaces`.")
]
LandmarksFile = Annotated[
    Path | None,
    typer.Option(
        help="CSV file, one row per landmark: name, vertex on each surface, from 0; or `none`."
    ),
]
Output = Annotated[
    list[Path],
    typer.Option(
        "-o", "--output", help="FILM.gif or .mp4, MESH.obj or .ply, FOLDER, .npz. Repeatable."
    ),
]
Frames = Annotated[
    int, typer.Option(min=2, max=100_000, help="Number of frames, played at 24 per second.")
]
Views = Annotated[str, typer.Option(help="Views of a film, comma-separated.")]
Side = Annotated[int, typer.Option(min=64, max=2160, help="Side of a view, in pixels.")]
AddTo = Annotated[
    Path | None, typer.Option("--run", help="Add the pictures and figures to this run.")
]


@app.command(
    epilog="Examples:  cembench morph a.obj b.obj --landmarks ab.csv -o ab.gif  ·  "
    "cembench morph liu-wry-face-stand-in liu-smile-face-stand-in --faces 8000 -o liu.mp4  ·  "
    "cembench morph a.ply b.ply -o frames/ab.obj -o ab.npz --json"
)
@from_api(morph_surfaces, without=("reporter",), lam="--lambda")
def morph(
    call: Call,
    surfaces: Surfaces,
    *,
    landmarks: LandmarksFile = None,
    output: Output = [],  # noqa: B006 - typer copies defaults
    frames: Frames = 48,
    views: Views = "front,side,three-quarter",
    size: Side = 480,
    run: AddTo = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the films and meshes of the path, and print how well the surfaces are registered."""
    from cembench.core.overwriting import refuse_inputs
    from cembench.results import run_folder

    from .morph_exhibits import write_exhibits
    from .morphing.drawing import check_views
    from .morphing.writers import check_output, files_of, is_film, write_path

    chosen_views, keywords = split([views]), call.keywords
    check_views(chosen_views)
    sources = [Path(name) for name in surfaces] + ([landmarks] if landmarks else [])
    for place in output:
        check_output(place)
        for file in files_of(place, frames):
            refuse_inputs(file, sources, force=force)
    if run is not None:
        run_folder.check(run)
    try:
        morphed = call(surfaces, landmarks, reporter=SHOWN)
    except AlgorithmFailed as error:
        complain(str(error))
        raise typer.Exit(1) from None
    seconds = dict(morphed.seconds)
    figures: dict[str, Any] = {
        "surfaces": [mesh.name for mesh in morphed.meshes],
        "landmarks": list(morphed.landmarks.names),
        "algorithm": keywords["algorithm"],
        "lambda": keywords["lam"],
        "reach": keywords["reach"],
        "frames": frames,
    } | morphed.metrics(frames)
    kinds = {"frames": [o for o in output if not is_film(o)], "film": [*filter(is_film, output)]}
    written = list(output)
    with SHOWN.busy("writing") as tell:
        for kind, places in kinds.items():
            if places:
                with _timed(seconds, kind):
                    write_path(morphed, places, frames, chosen_views, size, tell)
        if run is not None:
            again = f"{_words(surfaces, landmarks, keywords)} --run {run}"
            rows = _rows(surfaces, keywords["plugins"])
            written += write_exhibits(run, morphed, figures, again, rows, tell)
    if as_json:
        print_json(figures | {"seconds": seconds, "written": [str(path) for path in written]})
        return
    _print(figures, morphed.landmarks.names)
    for path in written:
        print_pair("written", path)
    if not written:
        out.print("Nothing was written; add -o FILM.gif to see it.", style="dim")


def _words(surfaces: list[str], landmarks: Path | None, keywords: Mapping[str, Any]) -> str:
    """Return the command that morphs these surfaces again."""
    words = [*surfaces, *(["--landmarks", str(landmarks)] if landmarks else [])]
    words += ["-a", keywords["algorithm"]]
    words += [] if keywords["faces"] is None else ["--faces", str(keywords["faces"])]
    return f"cembench morph {' '.join(words)}"


def _rows(surfaces: list[str], plugins: Sequence[str]) -> tuple[str, ...]:
    """Return the models of the paper that surfaces stand for, "" for others."""
    from cembench.registry import load_registry
    from cembench.running.plan import provenances

    registry = load_registry(plugins)
    roles = provenances(registry, [name for name in surfaces if name in registry.surfaces])
    return tuple(roles[name].paper_row if name in roles else "" for name in surfaces)


@contextmanager
def _timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    started = perf_counter()
    yield
    seconds[name] = perf_counter() - started


def _print(figures: dict[str, Any], landmarks: tuple[str, ...]) -> None:
    """Print the figures."""
    from cembench.report.content.exhibits import exhibit_table

    from .morphing.metrics import tables_of

    print_pair("landmarks", ", ".join(landmarks) or "none: aligned by curvature")
    print_pair("lambda", f"{figures['lambda']:g}" if landmarks else "-")
    for table in tables_of(figures):
        out.print(exhibit_table(table, "", "surface"))

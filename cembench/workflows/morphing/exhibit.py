"""Exhibits of a morph: its strip and its registrations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from cembench.core.atomic import write_bytes
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    exhibit_folder,
    write_exhibit,
)
from cembench.results.papers import usual_paper
from cembench.results.records import MeshOrigin
from cembench.workflows.morphing.morph import Morph
from cembench.workflows.morphing.pages import registration_page, strip_page


def write_morph_exhibits(
    run: Path,
    morph: Morph,
    figures: dict[str, Any],
    command: str,
    rows_of_paper: tuple[str, ...],
    tell: Callable[[str], object] = lambda step: None,
    sides: tuple[int, int] = (240, 420),
) -> list[Path]:
    """Write both exhibits to a run's folder; return the paths of their descriptions.

    `figures` are the morph's metrics; `rows_of_paper` are the paper's models that the surfaces
    stand in for, "" for none; `sides` are the pixels of a picture on each page.
    """
    paper = usual_paper()
    origin: MeshOrigin = "stand-in" if all(rows_of_paper) else "surface"
    names = [mesh.name for mesh in morph.meshes]
    stem = "-".join(names)
    shared: dict[str, Any] = {"command": command, "origin": origin, "facts": figures}
    tell("drawing the strip")
    strip = _picture(
        run,
        f"morph-{stem}",
        "strip.png",
        strip_page(morph, sides[0]),
        f"From {names[0]} to {names[-1]}: seven moments of the path, from the front and the side.",
    )
    board = _picture(
        run,
        f"registration-{stem}",
        "maps.png",
        registration_page(morph, sides[1], tell),
        "Conformal maps, and below them the Moebius map and the registrations: now equal squares "
        "lie on the same features. Dots are landmarks, rings their targets.",
    )
    spline = "a cubic spline" if len(names) > 2 else "a straight line"
    done = [
        Exhibit(
            name=f"morph-{stem}",
            title="Morph: " + ", ".join(names),
            text=f"The vertices of {names[0]} are carried onto the other surfaces, and {spline} in "
            "time leads through their places.",
            figure=paper.exhibited("morph", rows_of_paper),
            pictures=(strip,),
            tables=(_path_table(figures),),
            **shared,
        ),
        Exhibit(
            name=f"registration-{stem}",
            title="Registration: " + ", ".join(names),
            text="Conformal maps f of the surfaces to the disk; a Moebius map m1 that takes the "
            "first landmark to the centre; registration maps r that minimise (34).",
            figure=paper.exhibited("registration", rows_of_paper),
            pictures=(board,),
            tables=(registration_table(figures),),
            **shared,
        ),
    ]
    return [write_exhibit(run, exhibit) for exhibit in done]


def _picture(run: Path, name: str, file: str, content: bytes, caption: str) -> ExhibitPicture:
    write_bytes(exhibit_folder(run, name) / file, content)
    return ExhibitPicture(file=file, caption=caption, alternative=caption)


def registration_table(figures: dict[str, Any]) -> ExhibitTable:
    """Return a table of the registration metrics, one row per surface."""
    keys = {
        "surface": "surface",
        "landmark_error_share": "landmark error / size",
        "dirichlet_energy": "E_D",
        "dilatation_mean": "mean dilatation",
        "dilatation_max": "maximum dilatation",
        "flipped_triangles": "folds",
        "distance_mean_edges": "mean distance / edge",
        "hausdorff_edges": "Hausdorff / edge",
    }
    rows = tuple(tuple(row[key] for key in keys) for row in figures["registrations"])
    return ExhibitTable(
        title="Registrations",
        columns=tuple(keys.values()),
        rows=rows,
        notes=(
            "Distances between the carried surface and its target, the larger of both ways, over "
            "all vertices and 50,000 random points each, in mean edges of the target.",
        ),
    )


def _path_table(figures: dict[str, Any]) -> ExhibitTable:
    return ExhibitTable(
        title="Smoothness of the path",
        columns=("largest acceleration of a vertex", "largest step between frames"),
        rows=((figures["largest_acceleration_share"], figures["largest_step_share"]),),
        notes=("In sizes of the first surface; the time from the first to the last is 1.",),
    )

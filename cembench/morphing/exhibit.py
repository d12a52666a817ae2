"""Exhibits of a morph: its strip and its registrations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from cembench.core.atomic import write_bytes
from cembench.morphing.morph import Morph
from cembench.morphing.pages import registration_page, strip_page
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    exhibit_folder,
    write_exhibit,
)
from cembench.results.papers import usual_paper
from cembench.results.records import MeshOrigin


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
    registrations, path = morph_tables(figures)
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
            tables=(path,),
            **shared,
        ),
        Exhibit(
            name=f"registration-{stem}",
            title="Registration: " + ", ".join(names),
            text="Conformal maps f of the surfaces to the disk; a Moebius map m1 that takes the "
            "first landmark to the centre; registration maps r that minimise (34).",
            figure=paper.exhibited("registration", rows_of_paper),
            pictures=(board,),
            tables=(registrations,),
            **shared,
        ),
    ]
    return [write_exhibit(run, exhibit) for exhibit in done]


def _picture(run: Path, name: str, file: str, content: bytes, caption: str) -> ExhibitPicture:
    write_bytes(exhibit_folder(run, name) / file, content)
    return ExhibitPicture(file=file, caption=caption, alternative=caption)


#: The figures of a registration: the heading and the format of each.
_REGISTRATION = {
    "surface": ("surface", ""),
    "steps": ("steps to lambda", "d"),
    "landmark_error_share": ("landmark error / size", ".2e"),
    "dirichlet_energy": ("E_D", ".4f"),
    "dilatation_mean": ("mean dilatation", ".2f"),
    "dilatation_max": ("maximum dilatation", ".1f"),
    "flipped_triangles": ("folds", "d"),
    "distance_mean_edges": ("mean distance / edge", ".3f"),
    "hausdorff_edges": ("Hausdorff / edge", ".2f"),
}


def morph_tables(figures: dict[str, Any]) -> tuple[ExhibitTable, ExhibitTable]:
    """Return the metrics of the registrations, one row per surface, and those of the path."""
    rows = [{**row, "steps": len(row["lambdas"])} for row in figures["registrations"]]
    registrations = ExhibitTable.of(
        "Registrations",
        _REGISTRATION,
        rows,
        notes=(
            "Distances between the carried surface and its target, the larger of both ways, over "
            "all vertices and 50,000 random points each, in mean edges of the target. A dash: no "
            "landmarks, or a triangle of almost no area, whose dilatation is not finite.",
        ),
    )
    path = {
        "largest_acceleration_share": ("largest acceleration of a vertex", ".3f"),
        "largest_step_share": ("largest step between frames", ".4f"),
    }
    note = "In sizes of the first surface; the time from the first to the last is 1."
    return registrations, ExhibitTable.of("Smoothness of the path", path, [figures], notes=(note,))

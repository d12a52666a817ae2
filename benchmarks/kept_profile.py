"""Who is fastest on how many surfaces? Draws the profile of a kept report from its records.

python -m benchmarks.kept_profile [reports/paper reports/standard]

A kept report has a row for each record and no run, so that what has changed in how a profile is
made can still be applied to it.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.pages import ROOT
from cembench.core.atomic import write_bytes, write_text
from cembench.report.content.evidence import Evidence
from cembench.report.declared_plots import declared_plot
from cembench.report.plots import Plot, write_plot
from cembench.results.records import Cell, MeshFacts, Outcome, Record, Round
from cembench.results.store import Store

KEPT = ("reports/paper", "reports/standard")


def evidence_of(folder: Path) -> Evidence:
    """Read what a profile needs out of a kept report's records."""
    with (folder / "records.csv").open(newline="") as lines:
        records = [_record(row) for row in csv.DictReader(lines)]
    return Evidence(Store(folder), tuple(records), ())


def _record(row: dict[str, Any]) -> Record:
    seconds = float(row["seconds"]) if row["seconds"] else None
    error = row["angle_error_mean_deg"]
    return Record(
        cell=Cell(
            algorithm=row["algorithm"],
            parameters=json.loads(row["parameters"] or "{}"),
            code_hash=row["key"],
            mesh=row["mesh"],
            mesh_hash=row["mesh_hash"],
            solves=row["solves"],
            backend=row["backend"],
            threads=int(row["threads"]),
        ),
        title=row["title"],
        target=row["target"],
        mesh=MeshFacts(
            vertices=int(row["vertices"]),
            faces=int(row["faces"]),
            boundary_vertices=int(row["boundary_vertices"]),
            non_delaunay_share=float(row["non_delaunay_share"]),
            paper_row=row["paper_row"],
            origin=row["origin"],
        ),
        outcome=Outcome(
            status=row["status"],
            cause=row["cause"] or None,
            rounds=(Round(sitting="kept", calls=(seconds,), phases={}),) if seconds else (),
            metrics={"angle_error_mean_deg": float(error)} if error else {},
        ),
        environment=row["environment"],
        started_at=row["started_at"],
    )


def main(folders: list[str]) -> None:
    """Draw the profiles."""
    for name in folders or KEPT:
        plot = declared_plot(evidence_of(ROOT / name), "performance-profile")
        if plot is not None:
            keep(plot, ROOT / name)
            print(f"{name}: {', '.join(panel.title for panel in plot.panels)}\n{plot.caption}")


def keep(plot: Plot, folder: Path) -> None:
    """Put a plot where the report has it: its picture and data, and its caption."""
    with TemporaryDirectory() as made:
        write_plot(plot, Path(made))
        for suffix in ("png", "csv"):
            drawn = Path(made) / "figures" / f"{plot.name}.{suffix}"
            write_bytes(folder / "figures" / drawn.name, drawn.read_bytes())
    page = folder / "report.md"
    before, image, rest = page.read_text().partition(f"](figures/{plot.name}.png)\n\n")
    _, data, after = rest.partition(" ([data]")
    write_text(page, f"{before}{image}{plot.caption}{data}{after}")


if __name__ == "__main__":
    main(sys.argv[1:])

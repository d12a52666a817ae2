"""Who is fastest on how many surfaces? From the records of a kept report."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.pages import ROOT, Section
from cembench.report.content.evidence import Evidence
from cembench.report.declared_plots import declared_plot
from cembench.report.plots import Plot, write_plot
from cembench.results.records import Record
from cembench.results.store import Store

#: What a profile needs of a cell, its mesh and its record.
CELL = ("algorithm", "mesh", "mesh_hash", "solves", "backend", "threads")
MESH = (*("vertices", "faces", "boundary_vertices", "non_delaunay_share", "paper_row", "origin"),)
RECORD = ("title", "target", "environment", "started_at")


def evidence_of(folder: Path) -> Evidence:
    """Read what a profile needs out of a kept report's records."""
    with (folder / "records.csv").open(newline="") as lines:
        records = [_record(row) for row in csv.DictReader(lines)]
    return Evidence(Store(folder), tuple(records), ())


def _record(row: dict[str, Any]) -> Record:
    cell, mesh, own = ({name: row[name] for name in names} for names in (CELL, MESH, RECORD))
    cell |= {"parameters": json.loads(row["parameters"] or "{}"), "code_hash": row["key"]}
    seconds, error = row["seconds"], row["angle_error_mean_deg"]
    outcome = {
        "status": row["status"],
        "cause": row["cause"] or None,
        "rounds": [{"sitting": "kept", "calls": [seconds], "phases": {}}] if seconds else [],
        "metrics": {"angle_error_mean_deg": error} if error else {},
    }
    return Record.model_validate({**own, "cell": cell, "mesh": mesh, "outcome": outcome})


def kept_profile(
    reports: Sequence[str] = ("reports/paper", "reports/standard"),
) -> list[Section]:
    """Draw the performance profile of kept reports from their records.

    A kept report has a row for each record and no run, so that what has changed in how a profile is
    made can still be applied to it.
    """
    plots = {
        name: declared_plot(evidence_of(ROOT / name), "performance-profile") for name in reports
    }
    return [
        Section(
            [f"{name}: {', '.join(panel.title for panel in plot.panels)}\n{plot.caption}"],
            files=files_of(plot, name),
        )
        for name, plot in plots.items()
        if plot is not None
    ]


def files_of(plot: Plot, report: str) -> dict[str, bytes | str]:
    """Return a plot's picture and data, and the report's page with its caption."""
    with TemporaryDirectory() as folder:
        write_plot(plot, Path(folder))
        names = [f"figures/{plot.name}.{suffix}" for suffix in ("png", "csv")]
        files: dict[str, bytes | str] = {
            f"{report}/{name}": (Path(folder) / name).read_bytes() for name in names
        }
    page = (ROOT / report / "report.md").read_text()
    before, image, rest = page.partition(f"](figures/{plot.name}.png)\n\n")
    _, data, after = rest.partition(" ([data]")
    return files | {f"{report}/report.md": f"{before}{image}{plot.caption}{data}{after}"}

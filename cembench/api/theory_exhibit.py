"""Exhibit of the tests of Section 4 of the paper on a surface."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cembench.api.theory_facts import LOOKS, TheoryFacts
from cembench.api.theory_plot import write_theory_plot
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    exhibit_folder,
    place_of,
    write_exhibit,
)

#: The file of the picture.
PICTURE = "theory.png"


def claim_exhibit(run: Path, mesh: DiskMesh) -> Path:
    """Return the folder of a surface's exhibit in a run; raise if it cannot be written to."""
    return exhibit_folder(run, f"theory-{mesh.name}")


def add_exhibit(run: Path, found: TheoryFacts, command: str) -> None:
    """Add the exhibit of what was found to a run; `command` is the one that makes it again."""
    facts = found.facts
    exhibit = theory_exhibit(found, command)
    write_theory_plot(
        place_of(run, exhibit.name, PICTURE),
        f"{facts['mesh']}: {facts['vertices']:,} vertices, {facts['boundary_vertices']} on the "
        "boundary",
        found.spectrum,
        found.trajectories,
        found.others,
        facts["rate_predicted"],
    )
    write_exhibit(run, exhibit)


def theory_exhibit(found: TheoryFacts, command: str = "") -> Exhibit:
    """Return what was found as an exhibit: a summary, tables, and the name of a picture."""
    facts = dict(found.facts)
    return Exhibit(
        name=f"theory-{facts['mesh']}",
        title=f"Section 4 on {facts['mesh']}",
        text=_summary(facts) + (f" {found.missing}" if found.missing else ""),
        command=command,
        origin="surface",
        pictures=(
            ExhibitPicture(
                file=PICTURE,
                caption="Spectrum of K, conformal energy and steps of the bare iterations.",
                alternative=_summary(facts),
            ),
        ),
        tables=tuple(_tables(facts)),
        facts=facts,
    )


def _summary(facts: dict[str, Any]) -> str:
    broken = [check["name"] for check in facts["premises"] if not check["holds"]]
    fails = [check["name"] for check in facts["statements"] if not check["holds"]]
    count = len(facts["statements"])
    words = "All premises hold." if not broken else f"Premises that fail: {'; '.join(broken)}."
    words += (
        f" All {count} statements hold."
        if not fails
        else f" Of {count} statements these fail: {'; '.join(fails)}; the others hold."
    )
    speed = (
        f" The gap of K is {facts['gap']:.4g}; a step of (23) shrinks to {facts['rate_23']:.4f} of "
        f"the one before (predicted {facts['rate_predicted']:.4f}), of (30) to "
        f"{facts['rate_30']:.4f}."
    )
    return words + speed


def _tables(facts: dict[str, Any]) -> Iterator[ExhibitTable]:
    checks = {"name": ("what", ""), "source": ("where", ""), "holds": ("holds", "")}
    checks |= {"figure": ("figure", ".3g"), "meaning": ("meaning", "")}
    for part in ("premises", "statements"):
        rows = [{**check, "holds": "yes" if check["holds"] else "NO"} for check in facts[part]]
        yield ExhibitTable.of(part.capitalize(), checks, rows, details=("meaning",))
    looks = {f"after_{k}": (f"after {k}", ".6f") for k in LOOKS} | {"last": ("last", ".6f")}
    columns = {"name": ("iteration", ""), **looks, "iterations": ("iterations", "d")}
    title = "Conformal energy E_C"
    yield ExhibitTable.of(title, columns, facts["energies"], details=("iterations",))
    yield _certificate_table(facts["certificate"])


def _certificate_table(found: dict[str, Any]) -> ExhibitTable:
    title = "Modulus of the surface with four boundary points"
    columns = ("four boundary points", "modulus", "off by")
    if "missing" in found:
        return ExhibitTable(title=title, columns=columns, rows=(), notes=(found["missing"],))
    modulus = found["modulus"]
    return ExhibitTable(
        title=title,
        columns=columns,
        rows=(
            ("surface, at least", found["lower"], None),
            ("surface, at most", found["upper"], None),
            ("middle of both", modulus, found["reciprocal_error"]),
            *(
                (name, None if off is None else modulus * (1 + off), off)
                for name, off in found["off"].items()
            ),
        ),
        forms={"modulus": ".5f", "off by": "+.1e"},
    )

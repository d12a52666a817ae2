"""A small report with everything a report can hold, for tests of its forms."""

from pathlib import PurePosixPath

import numpy as np
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from PIL import Image, ImageDraw

from cembench.drawing.view_scene import ViewedMap, view_scene
from cembench.report.document import (
    Claim,
    Column,
    Figure,
    Finding,
    Findings,
    Gallery,
    Gap,
    Report,
    Section,
    Table,
    Text,
    Value,
    missing,
)
from cembench.results.papers import find_paper

CITATION = find_paper("cem")
ALGORITHMS = ("cem", "qiem", "fdm", "ldm")
SURFACES = ("Foot", "Chinese Lion", "Bourbon Bottle")
#: A name that would be code in a page that does not escape it.
HOSTILE = "<script>alert('x')</script> \"O'Hara\" & sons"


def sample_report(folder):
    """The report, with its files in `folder`."""
    for name in ("pictures", "figures", "tables"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "tables" / "times.csv").write_text("surface,cem\nFoot,0.35\n")
    surfaces = (*SURFACES, HOSTILE)
    return Report(
        title="A small report",
        command="cembench report results/small",
        facts=(
            ("Machine", "2 cores, 8 GB"),
            ("Cells", "14 ok, 1 failed, 1 timeout"),
            ("Versions", "Python 3.11, numpy 2.1, scipy 1.13"),
        ),
        sections=(
            Section(
                "tables",
                "Tables of the paper",
                (
                    Text("Printed figures stand beside measured ones; see `cembench report`."),
                    _times(surfaces),
                    _wide(surfaces),
                ),
            ),
            Section(
                "figures",
                "Figures",
                (_plot(folder), Gap("Figure 13", "it is a morph.", "cembench morph a b")),
            ),
            Section("claims", "Claims", CLAIMS),
            Section(
                "surfaces",
                "Surfaces",
                (Text("A page for each of them."),),
                tuple(_page(folder, k, name) for k, name in enumerate(surfaces)),
            ),
        ),
        records={
            _key(s, a): {
                "mesh": s,
                "algorithm": a,
                "title": a.upper(),
                "status": "timeout" if (s, a) == (SURFACES[2], "fdm") else "ok",
                "seconds": 0.1 * k + 0.0123,
                "seconds_raw": [0.1, 0.2, 0.3],
                "phases": {"laplacian": 0.01, "solves": 0.02},
                "notes": ["boundary vertices without an interior neighbour"],
                "cause": None,
            }
            for k, s in enumerate(surfaces)
            for a in ALGORITHMS
        },
        findings=Findings(
            (
                ("CEM against QIEM: printed 8.5; here 7.0.",),
                ("Of 4 claims, 1 does not hold here: ", CLAIMS[2], "; 1 holds."),
            ),
            suspects=(f"FDM on {HOSTILE}: 70.3 degrees, the other algorithms' median is 2.4",),
            tables=(_own(surfaces),),
            figures=(Finding("14 of 16", "cells ended with a valid map"),),
        ),
        paper=CITATION,
    )


def _own(surfaces):
    """A table of surfaces by two groups of algorithms."""
    columns = (
        Column("surface", numeric=False),
        *(Column(a, group) for group in ("angle", "folds") for a in ALGORITHMS),
    )
    rows = tuple(
        (
            Value(s),
            *(Value(f"{k + n}", k + n, "surface", _key(s, ALGORITHMS[n % 4])) for n in range(8)),
        )
        for k, s in enumerate(surfaces)
    )
    return Table("own", "All surfaces", columns, rows)


def _key(surface, algorithm):
    return f"{abs(sum(map(ord, surface))):x}{algorithm}"


def _times(surfaces):
    """Columns of one origin and of several, gaps with a cause, a column of words, two footers."""
    seconds = (0.35, 0.45, 0.27, 12.5)

    def measured(surface, algorithm, number, origin):
        return Value(f"{number:.2f}", number, origin, _key(surface, algorithm))

    rows = [
        (
            Value(surface),
            Value(f"{19966 + 1000 * k:,}", 19966 + 1000 * k),
            Value(f"{seconds[k]:.2f}", seconds[k], "printed"),
            measured(surface, "cem", seconds[k] / 3, "model" if k == 1 else "stand-in"),
            missing("printed as a dash") if k == 0 else Value("1.05", 1.05 + k, "printed"),
            missing("out of time after 60 s")
            if k == 2
            else measured(surface, "fdm", 1.3 - k / 3, "stand-in"),
        )
        for k, surface in enumerate(surfaces)
    ]
    foot = (Value("Mean"), Value(""), *(Value("1.00", 1.0, "derived") for _ in range(4)))
    count = (Value("n"), Value(""), Value("4"), Value("4"), Value("3"), Value("3"))
    return Table(
        "times",
        "Table 1. Seconds.",
        (
            Column("Surface", numeric=False),
            Column("Faces"),
            Column("printed", "CEM", "s"),
            Column("here", "CEM", "s"),
            Column("printed", "FDM", "s"),
            Column("here", "FDM", "s"),
        ),
        (*rows, foot, count),
        "Time from the arrays to the map.",
        ("Means run over n surfaces.",),
        footer_rows=2,
    )


def _wide(surfaces):
    """More columns than a telephone has room for."""
    columns = (Column("Surface", numeric=False), *(Column(f"quantity {k}") for k in range(14)))
    rows = tuple(
        (Value(s), *(Value(f"{k * 1.5 + n:.4f}", k * 1.5 + n, "surface") for n in range(14)))
        for k, s in enumerate(surfaces)
    )
    return Table("wide", "Many quantities.", columns, rows)


def _plot(folder):
    x, y = [1e3, 1e4, 1e5], [0.01, 0.12, 1.3]
    (folder / "figures" / "cost.csv").write_text("faces,seconds\n1000,0.01\n")
    (folder / "figures" / "cost.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="300pt" height="200pt" '
        'viewBox="0 0 300 200"><path d="M20 180 L280 20" stroke="#333"/></svg>'
    )
    _picture(folder / "figures" / "cost.png", "#333333")
    plot = {
        "data": [
            {"type": "scatter", "x": x, "y": y, "name": "CEM"},
            {"type": "bar", "x": [f"the {k}th of some bars" for k in range(6)], "y": [3.0] * 6}
            | {"xaxis": "x2", "yaxis": "y2", "name": "Shares"},
        ],
        "layout": {
            "title": {"text": "Cost"},
            "width": 900,
            "height": 430,
            "grid": {"rows": 1, "columns": 2, "pattern": "independent"},
            "xaxis": {"type": "log", "title": {"text": "faces"}},
            "yaxis": {"type": "log", "title": {"text": "seconds"}},
        },
    }
    files = ("figures/cost.png", "figures/cost.svg")
    return Figure(
        "cost",
        "Cost against faces.",
        tuple(map(PurePosixPath, files)),
        "Axes are logarithmic.",
        PurePosixPath("figures/cost.csv"),
        plot,
        "Seconds rise with faces, with exponent 1.06.",
        "Figure 8",
    )


def _page(folder, place, name):
    colours = ("#4477aa", "#ee6677", "#228833", "#ccbb44")
    pictures = []
    for algorithm, colour in zip(ALGORITHMS, colours, strict=True):
        file = PurePosixPath("pictures", f"surface{place}-{algorithm}.png")
        _picture(folder / file, colour)
        pictures.append(
            Figure(
                f"surface{place}-{algorithm}",
                f"{algorithm.upper()} on {name}",
                (file,),
                alternative=f"The disk of {name} under a checkerboard, mapped by {algorithm}",
                record=_key(name, algorithm),
            )
        )
    scene = _scene() if place == 0 else b""
    gallery = Gallery(f"maps-{place}", "Maps.", tuple(pictures), "One checkerboard for all.", scene)
    return Section(f"surface-{place}", name, (Text(f"All on {name}."), gallery), page=True)


def _scene():
    """A bowl by two maps; the second folds it in the middle."""
    mesh = hemi_ellipsoid(600)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    folded = np.where(np.abs(z) < 0.3 * np.abs(z).max(), -z, z)
    return view_scene(
        mesh, [ViewedMap("cem", z, "cem, a line."), ViewedMap("qiem", folded)], "Foot"
    )


def _picture(path, colour):
    picture = Image.new("RGB", (640, 480), "white")
    ImageDraw.Draw(picture).ellipse((90, 10, 550, 470), fill=colour)
    picture.save(path)


CLAIMS = tuple(
    Claim(
        f"claim-{k}",
        sentence,
        place,
        "Medians of paired rounds on every surface.",
        figures,
        verdict,
        remark,
    )
    for k, (sentence, place, figures, verdict, remark) in enumerate(
        (
            ("CEM always has a better efficiency", "Section 5.1", "11 of 12", "holds in part", ""),
            ("energy monotonically decreasing", "Section 4", "80 of 80 steps", "holds", ""),
            ("less than one second", "Abstract", "1.3 s", "does not hold here", "A slow machine."),
            (
                "the first genus-zero morph",
                "Section 6",
                "",
                "not tested here",
                "No morph was made.",
            ),
        )
    )
)

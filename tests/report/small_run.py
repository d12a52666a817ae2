"""A run on disk with everything that can be in one, made in a moment: real maps, invented times."""

from itertools import count

import numpy as np
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.conformal.metrics import all_metrics
from cembench.registry import load_registry
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    exhibit_folder,
    write_exhibit,
)
from cembench.results.records import Outcome, Round
from cembench.results.store import Store
from tests.records import changed, record_on

#: Seconds of each algorithm; those of CEM are 1 on every surface.
SECONDS = {"cem": 1.0, "qiem": 4.0, "fdm": 3.0, "ldm": 0.5, "harmonic-circle": 0.25, "lscm": 2.0}
POLICIES = ("reuse", "backslash")


def meshes():
    """Surfaces by the row of the paper that they stand for."""
    return {
        "Chinese Vase": hemi_ellipsoid(300),
        "Liu's Neutral Face": spherical_cap(400),
        "": flat_disk(200, stretch=2.0),
    }


def cell(algorithm, mesh, policy):
    return record_on(mesh, algorithm, Outcome(status="ok"), solves=policy).cell


def record(algorithm, mesh, row, policy, outcome):
    facts = {"paper_row": row, "origin": "stand-in" if row else "surface"}
    made = record_on(mesh, algorithm, outcome, solves=policy)
    return changed(made, mesh=facts, environment="machine")


def ok(algorithm, mesh, seconds):
    """What a call comes to whose six rounds all took so many seconds."""
    solve = load_registry().algorithm(algorithm).function(mesh)
    half = {"solves": seconds / 2, "other": seconds / 2}
    rounds = tuple(Round(sitting="s", calls=(seconds,), phases=half) for _ in range(6))
    outcome = Outcome(
        status="ok",
        rounds=rounds,
        metrics=all_metrics(mesh, solve.uv),
        iterations=solve.iterations,
        energy_history=solve.energy_history,
        extras=solve.extras,
        peak_memory_bytes=10**8,
        memory_increase_bytes=10**7,
    )
    return outcome, solve.uv


def write_run(folder, policies=POLICIES, algorithms=tuple(SECONDS)):
    """The run: two models, another surface, cells that failed, timed out and are missing."""
    store = Store(folder)
    scale = count(1)
    for row, mesh in meshes().items():
        size = next(scale)
        for policy in policies:
            for algorithm in algorithms:
                if algorithm == "ldm" and row == "":
                    continue  # missing
                seconds = SECONDS[algorithm]
                uv = None
                if algorithm == "qiem" and row == "Chinese Vase":
                    outcome = Outcome(status="failed", cause="it_gave up & 100 % lost")
                elif algorithm == "fdm" and row == "":
                    outcome = Outcome(status="timeout", cause="not finished after 8 s")
                else:
                    slow = 2 if policy == "backslash" and algorithm == "cem" else 1
                    factor = 1.0 if algorithm == "cem" else float(size)
                    outcome, uv = ok(algorithm, mesh, slow * factor * seconds)
                store.save(
                    record(algorithm, mesh, row, policy, outcome), uv, {"id": "machine", "cpu": "x"}
                )
        store.save_mesh(mesh)
    disk = meshes()[""]
    store.save_plan([cell("ldm", disk, "reuse")])
    return store


def write_koebe(folder):
    """An exhibit with a picture and a table."""
    place = exhibit_folder(folder, "koebe")
    from cembench.drawing.painter import jpeg

    (place / "steps 1.jpg").write_bytes(jpeg(np.full((8, 8, 3), 200, dtype=np.uint8)))
    exhibit = Exhibit(
        name="koebe",
        title="Steps of Koebe's method",
        text="Hole after hole.",
        command="cembench holes --run RUN",
        origin="stand-in",
        figure="Figure 1",
        pictures=(ExhibitPicture(file="steps 1.jpg", caption="Steps"),),
        tables=(
            ExhibitTable(title="Sweeps", columns=("sweep", "off"), rows=((1, 0.1), (2, None))),
        ),
    )
    write_exhibit(folder, exhibit)

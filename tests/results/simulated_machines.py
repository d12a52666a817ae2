"""Runs of machines that do not exist: real maps, invented seconds, faster and slower."""

from functools import cache

import numpy as np

import cembench
from cembench.conformal.metrics import all_metrics
from cembench.registry import load_registry
from cembench.results.records import Outcome, Round
from cembench.results.store import Store
from tests.records import changed, record_on

#: Seconds of each algorithm on a machine of usual speed, for a surface of 300 faces.
SECONDS = {"cem": 0.010, "direct-cem": 0.008, "fdm": 0.030, "ldm": 0.012, "harmonic-circle": 0.004}
SURFACES = {"hemi-ellipsoid": 300, "spherical-cap": 400, "flat-disk": 200}
#: Seconds of the reference kernel on a machine of usual speed.
KERNEL = 0.015


@cache
def mapped(surface, algorithm):
    """A surface, its map and the map's figures."""
    registry = load_registry()
    mesh = cembench.surface(surface, SURFACES[surface])
    uv = registry.algorithm(algorithm).function(mesh).uv
    return mesh, uv, all_metrics(mesh, uv)


def record_of(surface, algorithm, number, speed, name, **round_):
    mesh, _, metrics = mapped(surface, algorithm)
    wobble = 1 + 0.1 * np.sin(13 * number + 7 * len(algorithm) + mesh.m)
    seconds = SECONDS[algorithm] / speed * wobble * mesh.m / 300
    about = {"calls": (seconds,), "kernel_seconds": KERNEL / speed, "sitting": f"s{number}"}
    one = Round(**(about | round_))
    failed = number % 5 == 4 and algorithm == "fdm" and surface == "flat-disk"
    outcome = Outcome(status="failed", cause="it gave up")
    if not failed:
        outcome = Outcome(status="ok", rounds=(one,) * 6, metrics=metrics)
    started = f"2026-0{1 + number % 9}-01T00:00:00+00:00"
    made = record_on(mesh, algorithm, outcome, mesh=name)
    family = {"family": surface} if name == surface else {}
    return changed(made, environment=f"e{number}", started_at=started, mesh=family)


def machine_run(folder, number, mesh="flat-disk", **round_):
    """The run of a machine, whose speed rises with its number; `mesh` names the flat disk."""
    store, speed = Store(folder), 0.5 + 0.1 * number
    environment = {
        "id": f"e{number}",
        "machine": f"node-{number}",
        "cpu": f"processor {number % 3}",
        "cores": 4,
        "hardware_threads": 8,
        "cembench": "0.1.0",
        "libraries": {"numpy": "2.4"},
        "git": {"commit": f"{number}" * 40, "dirty": False},
    }
    for surface in SURFACES:
        for algorithm in SECONDS:
            name = mesh if surface == "flat-disk" else surface
            record = record_of(surface, algorithm, number, speed, name, **round_)
            measured, uv, _ = mapped(surface, algorithm)
            store.save(record, uv if record.outcome.rounds else None, environment)
        store.save_mesh(measured)
    return store

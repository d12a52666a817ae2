"""A built-in algorithm can be called once without other processes, with the same result."""

import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.registry import load_registry
from cembench.running import here
from cembench.running.local import map_once
from cembench.running.plan import MeasurementSettings, plan_cells


def task_of(spec, faces=500, **settings):
    how = MeasurementSettings(repeats=1, **settings)
    return plan_cells([spec], [hemi_ellipsoid(faces)], {}, how)[0]


@pytest.mark.parametrize("name", ["direct-cem", "lscm", "circle-packing"])
def test_the_map_and_its_figures_are_those_of_a_process_of_its_own(name):
    task = task_of(load_registry().algorithm(name))
    assert here.may_run_here(task)
    (record, uv), (apart, own) = here.map_here(task), map_once(task)
    np.testing.assert_allclose(uv, own, rtol=0, atol=1e-14)
    assert record.outcome.status == apart.outcome.status == "ok"
    assert record.outcome.metrics == pytest.approx(apart.outcome.metrics, rel=1e-9, abs=1e-12)
    assert record.cell == apart.cell


def test_what_is_not_ours_large_or_of_several_threads_has_its_own_process(monkeypatch):
    ours = load_registry().algorithm("cem")
    task = task_of(ours)
    assert here.may_run_here(task)
    assert not here.may_run_here(replace(task, algorithm=replace(ours, module=__name__)))
    assert not here.may_run_here(task_of(ours, threads=2))
    monkeypatch.setattr(here, "LARGE", 100)
    assert not here.may_run_here(task)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
def test_ctrl_c_is_no_fault_of_the_algorithm():
    ours = load_registry().algorithm("harmonic-circle")
    inside, other = threading.Event(), ours.function

    def slow(mesh, **parameters):
        inside.set()
        while True:
            other(mesh, **parameters)

    def press():
        inside.wait()
        signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    threading.Thread(target=press).start()
    with pytest.raises(KeyboardInterrupt):
        here.map_here(replace(task_of(ours), algorithm=replace(ours, function=slow)))
    assert signal.getsignal(signal.SIGINT) is before

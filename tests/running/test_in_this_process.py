"""A built-in algorithm can be called once without other processes, with the same result."""

import os
import signal
import sys
import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

import cembench
from cembench.registry import load_registry
from cembench.running import in_this_process
from cembench.running.local import map_once
from cembench.running.plan import MeasurementSettings, plan_cells


def task_of(spec, faces=500, **settings):
    how = MeasurementSettings(repeats=1, **settings)
    return plan_cells([spec], [hemi_ellipsoid(faces)], {}, how)[0]


NAMES = [a.name for a in load_registry().algorithms.values() if a.target == "disk"]


@pytest.mark.parametrize("name", NAMES)
def test_a_map_and_its_figures_do_not_depend_on_the_number_of_threads(name):
    mesh = hemi_ellipsoid(2_000)
    one, two = (cembench.parameterize(mesh, name, threads=count) for count in (1, 2))
    np.testing.assert_array_equal(one.z, two.z)
    assert one.metrics == two.metrics


def test_a_map_does_not_depend_on_the_threads_of_its_process():
    uv = [map_once(task_of(load_registry().algorithm("direct-cem"), 2_000, threads=k))[1]
          for k in (1, 2)]  # fmt: skip
    np.testing.assert_array_equal(*uv)


def parameterized(task):
    """The same call by the Python API."""
    return cembench.parameterize(task.mesh, "harmonic-circle")


@pytest.mark.parametrize("name", ["direct-cem", "lscm", "circle-packing"])
def test_the_map_and_its_figures_are_those_of_a_process_of_its_own(name):
    task = task_of(load_registry().algorithm(name))
    assert in_this_process.may_run_here(task)
    (record, uv), (apart, own) = in_this_process.map_here(task), map_once(task)
    np.testing.assert_allclose(uv, own, rtol=0, atol=1e-14)
    assert record.outcome.status == apart.outcome.status == "ok"
    assert record.outcome.metrics == pytest.approx(apart.outcome.metrics, rel=1e-9, abs=1e-12)
    assert record.cell == apart.cell


def test_what_is_not_ours_large_or_of_several_threads_has_its_own_process(monkeypatch):
    ours = load_registry().algorithm("cem")
    task = task_of(ours)
    assert in_this_process.may_run_here(task)
    assert not in_this_process.may_run_here(replace(task, algorithm=replace(ours, module=__name__)))
    assert not in_this_process.may_run_here(task_of(ours, threads=2))
    little = SimpleNamespace(available=in_this_process.ROUGH_BYTES_A_FACE * task.mesh.m)
    monkeypatch.setattr(in_this_process.psutil, "virtual_memory", lambda: little)
    assert not in_this_process.may_run_here(task)


def end(number, frame):
    """End as the command line does."""
    sys.exit(128 + number)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize(
    ("number", "handler", "raised"),
    [
        (signal.SIGINT, signal.default_int_handler, KeyboardInterrupt),
        (signal.SIGTERM, end, SystemExit),
    ],
)
@pytest.mark.parametrize("call", [in_this_process.map_here, parameterized])
def test_a_signal_is_no_fault_of_the_algorithm(call, number, handler, raised, monkeypatch):
    spec = load_registry().algorithm("harmonic-circle")
    inside = threading.Event()

    def slow(mesh, **parameters):
        inside.set()
        while True:
            spec.function(mesh, **parameters)

    def send():
        inside.wait()
        os.kill(os.getpid(), number)

    task = task_of(spec)
    task = replace(task, algorithm=replace(spec, function=slow))
    monkeypatch.setattr("cembench.registry.Registry.algorithm", lambda *_: task.algorithm)
    before = signal.signal(number, handler)
    try:
        threading.Thread(target=send).start()
        with pytest.raises(raised):
            call(task)
        assert signal.getsignal(number) is handler
    finally:
        signal.signal(number, before)

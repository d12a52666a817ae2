"""A unit that nobody waits for, and what its processes inherit."""

import os
import threading

import dask
import pytest

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
from cembench.core.errors import ClusterError
from cembench.results.store import Store
from cembench.running.cluster import worker
from cembench.running.cluster.units import pack
from cembench.running.cluster.worker import Forwarder, measure
from cembench.running.options import Options
from tests.running.cluster.test_units import NO_TOKEN
from tests.running.test_local import tasks_of


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_cancelled_unit_ends_at_once_and_saves_nothing_that_was_stopped(
    tmp_path, monkeypatch, jobs
):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    tasks = tasks_of("sleeps", "spins")
    unit = pack(tasks, NO_TOKEN, Options(jobs=jobs))
    started = threading.Event()

    def send(event):
        if event["what"] == "starts":
            started.set()

    forwarder = Forwarder(send, lambda: not started.is_set())
    with pytest.raises(ClusterError, match="cancelled"):
        measure(unit, Store(tmp_path / "run"), forwarder)
    assert Store(tmp_path / "run").finished() == []
    assert list((tmp_path / "run").glob("samples/*/*.jsonl")) == []


def test_settings_that_dask_made_for_a_worker_are_not_inherited_by_what_it_measures(monkeypatch):
    theirs = {"MALLOC_TRIM_THRESHOLD_": 65536, "OMP_NUM_THREADS": 1}
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "65536")
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    with dask.config.set({"distributed.nanny.pre-spawn-environ": theirs}):
        worker._unset_dask_variables()
    assert "MALLOC_TRIM_THRESHOLD_" not in os.environ
    assert os.environ["OMP_NUM_THREADS"] == "4"  # the user's own

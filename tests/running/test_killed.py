"""A run is killed at random moments, and two runs meet in one folder."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress

import psutil
import pytest

from cembench.results.samples import Samples
from cembench.results.store import Store
from tests.running.test_local import FAULTY


def command(folder):
    return [
        *(sys.executable, "-m", "cembench.commands.cli", "run", "--plugin", FAULTY, "--json"),
        *("--surfaces", "flat-disk", "--faces", "600", "-a", "good,by-chance,nan,harmonic-circle"),
        *("--repeats", "2", "-o", str(folder)),
    ]


def started(folder):
    return subprocess.Popen(
        command(folder), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def assert_server_gone(run):
    """The processes of a run that was killed are forked by a server that ends with it."""
    while servers_of(run):
        time.sleep(0.01)  # for ever, should one not end: how long that takes is up to the machine


def servers_of(run):
    collected = []
    for one in psutil.process_iter():
        with suppress(psutil.Error):
            command = one.cmdline()
            if "cembench.running.fork_server" in command and str(run) in command:
                collected.append(one)
    return collected


@pytest.mark.parametrize("kills", [3, pytest.param(20, marks=pytest.mark.slow)])
def test_a_run_killed_at_random_moments_loses_nothing_that_was_finished(tmp_path, kills):
    moments = random.Random(kills)
    folder = tmp_path / "run"
    kept = {}
    for _ in range(kills):
        run = started(folder)
        time.sleep(moments.uniform(0.5, 2.0))
        os.kill(run.pid, signal.SIGKILL)
        run.communicate()
        assert_server_gone(run.pid)
        by_key = {path.name: path.read_bytes() for path in folder.glob("records/*.json")}
        assert {name: by_key[name] for name in kept} == kept
        kept = by_key
        Store(folder).finished()  # each can be read
        for journal in folder.glob("samples/*/*.jsonl"):
            Samples(journal).rounds()
    run = started(folder)
    rows = json.loads(run.communicate()[0])
    assert {row["algorithm"]: row["status"] for row in rows} == {
        "good": "ok",
        "by-chance": "ok",
        "nan": "invalid",
        "harmonic-circle": "ok",
    }
    assert all(len(row["seconds_raw"]) == 2 for row in rows if row["status"] == "ok")
    records = list(folder.glob("records/*"))
    assert len(records) == len({json.loads(p.read_bytes())["cell"]["algorithm"] for p in records})
    assert {name: (folder / "records" / name).read_bytes() for name in kept} == kept
    assert len(records) == 4
    assert not [*folder.glob("samples/*"), *folder.rglob(".draft-*"), *folder.glob("scratch/*")]


def test_of_two_runs_in_one_folder_the_second_waits_and_keeps(tmp_path):
    folder = tmp_path / "run"
    runs = [started(folder), started(folder)]
    said = [run.communicate() for run in runs]
    assert [run.returncode for run in runs] == [1, 1]  # "nan" is not ok
    first, second = (json.loads(output) for output, _ in said)
    assert first == second
    assert sorted("waiting" in errors for _, errors in said) == [False, True]
    for record in Store(folder).records():
        assert len({r.sitting for r in record.outcome.rounds}) <= 1

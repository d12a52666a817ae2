"""Whatever of a cluster is killed, nothing that was finished is lost; the same command goes on."""

import json
import os
import random
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress

import psutil
import pytest

from tests.running.test_local import FAULTY

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")

ALGORITHMS = {"good": "ok", "by-chance": "ok", "nan": "invalid", "harmonic-circle": "ok"}
SURFACES = ("flat-disk", "cone", "spherical-cap")


class Cluster:
    """A scheduler, two workers and a client, each a process that can be killed."""

    def __init__(self, folder, cache):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = port = free.getsockname()[1]
        address = f"tcp://127.0.0.1:{port}"
        dask = (sys.executable, "-m", "dask")
        worker = (*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--memory-limit")
        worker = (*worker, "0", "--death-timeout", "60", "--local-directory", str(cache))
        self.commands = {
            "scheduler": (*dask, "scheduler", "--port", str(port), "--no-dashboard"),
            "worker-1": worker,
            "worker-2": worker,
            "client": (
                *(sys.executable, "-m", "cembench.commands.cli", "run", "--plugin", FAULTY),
                *("--surfaces", ",".join(SURFACES), "--faces", "200", "--rounds", "1", "--json"),
                *("-a", ",".join(ALGORITHMS), "--cluster", address, "-o", str(folder)),
            ),
        }
        self.folder = folder
        self.environment = os.environ | {"CEMBENCH_CACHE": str(cache)}
        self.running = {}

    def start(self, *names):
        for name in names:
            before = self.running.get(name)
            if before is None or before.poll() is not None:
                self.running[name] = subprocess.Popen(
                    self.commands[name],
                    stdout=subprocess.PIPE if name == "client" else subprocess.DEVNULL,
                    stderr=subprocess.PIPE if name == "client" else subprocess.DEVNULL,
                    text=True,
                    env=self.environment,
                    start_new_session=True,
                )

    def kill(self, name):
        """Kill -9; of a worker its nanny's child, too, as a machine that goes does."""
        victim = self.running[name]
        with suppress(psutil.Error):
            for child in psutil.Process(victim.pid).children():
                child.kill()
        with suppress(ProcessLookupError):
            os.kill(victim.pid, signal.SIGKILL)
        victim.communicate()

    def records(self):
        there = self.folder.glob("records/[!.]*.json")  # a draft has a dot before its name
        return {path.name: path.read_bytes() for path in there}

    def end(self):
        for name in reversed(list(self.running)):
            self.kill(name)


@pytest.mark.slow
@pytest.mark.parametrize("kills", [20])
def test_random_kills_lose_nothing_that_was_finished(tmp_path, kills):
    chance = random.Random(kills)
    cluster = Cluster(tmp_path / "run", tmp_path / "cache")
    everyone = ("scheduler", "worker-1", "worker-2", "client")
    kept = {}
    try:
        for _ in range(kills):
            cluster.start(*everyone)
            time.sleep(chance.uniform(2.0, 15.0))
            cluster.kill(chance.choice(["scheduler", "worker-1", "client"]))
            found = cluster.records()
            assert {name: found[name] for name in kept} == kept
            kept = found
        for _ in range(5):  # a client whose scheduler was killed tells so, and is started again
            cluster.start(*everyone)
            told, said = cluster.running["client"].communicate()
            if cluster.running["client"].returncode != 2:
                break
            assert "the same command goes on" in said or "no scheduler answers" in said, said
        rows = json.loads(told)
    finally:
        cluster.end()
    assert {(row["mesh"], row["algorithm"]): row["status"] for row in rows} == {
        (surface, name): status for surface in SURFACES for name, status in ALGORITHMS.items()
    }
    found = cluster.records()
    assert {name: found[name] for name in kept} == kept
    assert len(found) == len(rows)


@pytest.mark.slow
def test_a_killed_client_leaves_nothing_behind_and_the_same_command_goes_on(tmp_path):
    cluster = Cluster(tmp_path / "run", tmp_path / "cache")
    command = list(cluster.commands["client"])
    command[command.index("--cluster") + 1] = "local:1"
    command[command.index("--surfaces") + 1] = "flat-disk,cone"
    command[command.index("-a") + 1] = "good,nan"
    cluster.commands["client"] = command
    try:
        cluster.start("client")
        while not cluster.records():
            assert cluster.running["client"].poll() is None
            time.sleep(0.01)
        started = psutil.Process(cluster.running["client"].pid).children(recursive=True)
        cluster.running["client"].kill()
        cluster.running["client"].wait()
        kept = cluster.records()
        psutil.wait_procs(started)  # for ever, should one not end
        cluster.start("client")
        cluster.running["client"].wait()
        rows = json.loads(cluster.said("client", "out").read_text())
    finally:
        cluster.end()
    assert [row["status"] for row in rows] == ["ok", "invalid"] * 2
    found = cluster.records()
    assert len(found) == 4
    assert {name: found[name] for name in kept} == kept

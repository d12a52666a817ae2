"""Whatever of a cluster is killed, nothing that was finished is lost; the same command goes on."""

import json
import os
import random
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
SURFACES = ("flat-disk", "cone", "spherical-cap", "hemi-ellipsoid")
EVERYONE = ("scheduler", "worker-1", "worker-2", "client")
#: What a client says that ends because its scheduler is gone, or not there yet.
GOES_ON = ("the same command goes on", "no scheduler answers")


class Cluster:
    """A scheduler, two workers and a client, each a process that can be killed."""

    def __init__(self, folder, cache):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = port = free.getsockname()[1]
        address = f"tcp://127.0.0.1:{port}"
        dask = (sys.executable, "-m", "dask")
        worker = (*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--memory-limit")
        worker = (*worker, "0", "--death-timeout", "20", "--local-directory", str(cache))
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
        self.folder, self.cache = folder, cache
        self.environment = os.environ | {"CEMBENCH_CACHE": str(cache)}
        self.running = {}
        folder.parent.mkdir(parents=True, exist_ok=True)

    def start(self, *names):
        """Start those that do not run; what they say goes to files, which never fill up."""
        for name in names:
            before = self.running.get(name)
            if before is None or before.poll() is not None:
                with self.said(name, "out").open("w") as out, self.said(name).open("w") as err:
                    self.running[name] = subprocess.Popen(
                        self.commands[name],
                        stdout=out,
                        stderr=err,
                        env=self.environment,
                        start_new_session=True,
                    )
                if name == "scheduler":
                    self.wait_for_scheduler()

    def wait_for_scheduler(self):
        while self.running["scheduler"].poll() is None:
            with suppress(OSError):
                socket.create_connection(("127.0.0.1", self.port)).close()
                return
            time.sleep(0.05)
        raise AssertionError(self.said("scheduler").read_text())

    def said(self, name, stream="err"):
        return self.folder.parent / f"{name}.{stream}"

    def kill(self, name):
        """Kill -9; of a worker first its nanny, which would start another, as a machine goes."""
        victim, below = self.running[name], []
        with suppress(psutil.Error):
            below = psutil.Process(victim.pid).children()
        victim.kill()
        for child in below:
            with suppress(psutil.Error):
                child.kill()
        victim.wait()

    def records(self):
        there = self.folder.glob("records/[!.]*.json")  # a draft has a dot before its name
        return {path.name: path.read_bytes() for path in there}

    def traces(self, kind):
        """What can be seen of a kind of progress; new traces are new progress."""
        if kind == "starts":
            return {name: process.pid for name, process in self.running.items()}.items()
        if kind == "recorded":
            return set(self.records())
        names = {"taken": "*/run/cembench.json", "measured": "*/run/samples/*/*.jsonl"}
        inside = set()
        for path in self.cache.glob(f"cluster/units/{names[kind]}"):
            with suppress(FileNotFoundError):  # finished, and deleted
                inside.add((path, path.stat().st_mtime_ns))
        return inside

    def ends_well(self):
        """Wait for the client; whether it came to its end. All others must stay."""
        while (code := self.running["client"].poll()) is None:
            for name in ("scheduler", "worker-1", "worker-2"):
                assert self.running[name].poll() is None, f"{name} ended by itself"
            time.sleep(0.05)
        said = self.said("client").read_text()
        assert code in (0, 1) or any(words in said for words in GOES_ON), said
        return code in (0, 1)

    def check_table(self):
        rows = json.loads(self.said("client", "out").read_text())
        assert {(row["mesh"], row["algorithm"]): row["status"] for row in rows} == {
            (surface, name): status for surface in SURFACES for name, status in ALGORITHMS.items()
        }
        assert len(self.records()) == len(rows)

    def end(self):
        for name in reversed(list(self.running)):
            self.kill(name)


def run_until_killed(cluster, chance, victim):
    """Start all, and kill one at a random moment of what they do; False if the run ended before."""
    kind = chance.choice(["starts", "taken", "measured", "recorded"])
    before = cluster.traces(kind)
    cluster.start(*EVERYONE)
    while not cluster.traces(kind) - before and cluster.running["client"].poll() is None:
        time.sleep(0.01)
    time.sleep(chance.uniform(0.0, 3.0 if kind == "starts" else 0.5))
    if cluster.running["client"].poll() in (0, 1):
        return False
    cluster.kill(victim)
    if victim == "scheduler":  # all others notice, and end
        for name in ("client", "worker-1", "worker-2"):
            cluster.running[name].wait()
        said = cluster.said("client").read_text()
        ended = cluster.running["client"].returncode
        assert ended in (0, 1) or any(words in said for words in GOES_ON), said
        return ended not in (0, 1)
    return True


@pytest.mark.slow
@pytest.mark.parametrize("kills", [20])
def test_random_kills_lose_nothing_that_was_finished(tmp_path, kills):
    chance = random.Random(kills)
    done, victim, kept = 0, "", {}
    cluster = Cluster(tmp_path / "after 0" / "run", tmp_path / "after 0" / "cache")
    try:
        while done < kills:
            # A surface that ends two workers of one client is recorded as failed, and rightly so.
            others = ["scheduler", "client", *(["worker-1"] if victim != "worker-1" else [])]
            victim = chance.choice(others)
            if run_until_killed(cluster, chance, victim):
                done += 1
                records = cluster.records()
                print(f"kill {done}: {victim}; {len(records)} cells are on disk", flush=True)
                assert {name: records[name] for name in kept} == kept
                kept = records
            else:  # it came to its end: the next run
                cluster.check_table()
                cluster.end()
                place, kept = tmp_path / f"after {done}", {}
                cluster = Cluster(place / "run", place / "cache")
        for _ in range(5):
            cluster.start(*EVERYONE)
            if cluster.ends_well():
                break
        cluster.check_table()
    finally:
        cluster.end()
    records = cluster.records()
    assert {name: records[name] for name in kept} == kept


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
    records = cluster.records()
    assert len(records) == 4
    assert {name: records[name] for name in kept} == kept

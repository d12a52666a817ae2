"""Nobody but the user who started a cluster's workers can reach them."""

import gc
import os
import subprocess
import sys

import psutil
import pytest

from cembench.core.errors import ClusterError

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")

from distributed import Client, Security

from cembench.running.cluster import connect
from cembench.running.cluster.connect import connected, parse_cluster

#: A stranger: connects with no certificate, and with one of their own, and asks for a process.
ATTACK = """
import os, sys
from distributed import Client, Security
port = sys.argv[1]
ways = ("tcp", None), ("tls", Security.temporary())
os.setgroups([]), os.setgid(65534), os.setuid(65534)  # the packages may be another user's
for protocol, security in ways:
    try:
        with Client(f"{protocol}://127.0.0.1:{port}", security=security, timeout=4) as client:
            print("ran as", client.submit(os.getuid).result(timeout=4))
    except (OSError, TimeoutError) as error:
        print("refused", type(error).__name__)
"""


@pytest.fixture(autouse=True)
def refused_clients_are_gone():
    """Collect clients that never connected here: inside dask's own lock they would wait for it."""
    gc.collect()
    yield
    gc.collect()


def ports_of(client):
    return client.scheduler.addr.rpartition(":")[2]


def test_all_that_is_started_here_listens_on_this_machine_alone(client):
    assert client.submit(os.getpid).result() != os.getpid()
    listening = [
        connection.laddr.ip
        for process in (psutil.Process(), *psutil.Process().children(recursive=True))
        for connection in process.net_connections()
        if connection.status == psutil.CONN_LISTEN
    ]
    assert len(listening) > 4
    assert {ip for ip in listening if not ip.startswith("127.")} == set()


def test_scheduler_and_workers_are_reached_by_the_certificates_of_the_run_alone(client):
    addresses = [client.scheduler.addr, *client.scheduler_info()["workers"]]
    assert all(address.startswith("tls://127.") for address in addresses)
    for address in addresses:
        for protocol, security in (("tcp", None), ("tls", Security.temporary())):
            theirs = address.replace("tls", protocol)
            with pytest.raises(OSError, match=r"reset|[Tt]imed out|closed|certificate"):
                Client(theirs, security=security, timeout=2, set_as_default=False)


def test_another_user_of_the_machine_runs_nothing(client):
    if os.geteuid() != 0:
        pytest.skip("NOT CHECKED: only root can start a process of another user")
    attack = [sys.executable, "-c", ATTACK, ports_of(client)]
    told = subprocess.run(attack, capture_output=True, text=True, cwd="/", check=True).stdout
    assert [line.split()[0] for line in told.splitlines()] == ["refused", "refused"]


def test_a_scheduler_without_certificates_is_warned_of(cli):
    code, _, err = cli(
        "run", "-a", "lscm", "--cluster", "tcp://127.0.0.1:9", "--surfaces", "flat-disk"
    )
    assert code == 2
    assert "warning: tcp://127.0.0.1:9 does not authenticate clients" in err
    assert parse_cluster("tls://host:8786").is_open is False


def test_certificates_that_are_missing_are_named(monkeypatch):
    monkeypatch.setattr(connect, "CONNECT_SECONDS", 2)
    with (
        pytest.raises(ClusterError, match="DASK_DISTRIBUTED__COMM__TLS__CA_FILE"),
        connected(parse_cluster("tls://127.0.0.1:9")),
    ):
        pass


def test_jobs_of_slurm_get_certificates_too(tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue")
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    where = parse_cluster("slurm:partition=cpu,cores=1,machines=1")
    monkeypatch.setattr("dask_jobqueue.SLURMCluster.adapt", lambda *_, **__: None)
    with connect._slurm(where) as cluster:
        assert cluster.scheduler_address.startswith("tls://")
        script = cluster.job_script()
        for words in ("--tls-ca-file", "--tls-cert", "--tls-key", "--dashboard-address 127."):
            assert words in script
        keys = list((tmp_path / "cluster" / "slurm").iterdir())
        assert keys
        assert all(path.stat().st_mode & 0o077 == 0 for path in keys)


SLURM = ("--cluster", "slurm:partition=cpu,cores=16", "--surfaces", "cone", "--faces", 300)


@pytest.mark.parametrize("more", [("--dry-run",), ()])
def test_slurm_without_its_command_is_said_at_once(cli, monkeypatch, more):
    pytest.importorskip("dask_jobqueue")
    monkeypatch.setattr("shutil.which", lambda name: None)
    code, out, err = cli("run", "-a", "harmonic-circle", *SLURM, *more)
    assert (code, out) == (2, "")
    assert "sbatch is not on this machine" in " ".join(err.split())
    assert not list(cli.folder.iterdir())


def test_a_job_that_slurm_refuses_ends_the_run_with_its_cause(tmp_path):
    """In a process of its own, since nothing may be left on its standard error."""
    pytest.importorskip("dask_jobqueue")
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, text in (("sbatch", "echo invalid partition: $2 >&2; exit 1"), ("scancel", "exit 1")):
        (commands / name).write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
        (commands / name).chmod(0o755)
    command = [sys.executable, "-m", "cembench.commands.cli", "run", "-a", "harmonic-circle"]
    known = {"PATH": f"{commands}{os.pathsep}{os.environ['PATH']}", "CEMBENCH_CACHE": str(tmp_path)}
    ended = subprocess.run(
        [*command, *map(str, SLURM), "-o", str(tmp_path / "run")],
        env=os.environ | known,
        capture_output=True,
        encoding="utf-8",
        timeout=300,
        check=False,
    )
    assert ended.returncode == 2, ended.stderr
    said = " ".join(ended.stderr.split())
    assert "Slurm takes no job: " in said
    assert "invalid partition" in said
    assert "Traceback" not in ended.stderr
    assert "internal error" not in said

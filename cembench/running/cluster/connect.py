"""Connect to the cluster that `cluster` names: local workers, a scheduler, or Slurm.

Anybody who can connect to a scheduler or worker of dask can run code as the user who started it. So
everything that is started here uses TLS with certificates made for the one run, and its web pages
are served to this machine only.
"""

from __future__ import annotations

import logging
import re
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from cembench.core.errors import ClusterError, ParameterError
from cembench.core.extras import Extra, require
from cembench.running.cluster.host import place

if TYPE_CHECKING:
    from distributed import Client

#: Slurm's command that submits a job.
SUBMIT = "sbatch"
#: Seconds after which an attempt to reach a scheduler is given up.
CONNECT_SECONDS = 15
#: Address of the web pages of schedulers and workers, which ask for no certificate.
_PAGES = "127.0.0.1:0"
#: Variables of dask for the certificates of a scheduler that the user started.
TLS_VARIABLES = tuple(
    f"DASK_DISTRIBUTED__COMM__TLS__{name}" for name in ("CA_FILE", "CLIENT__KEY", "CLIENT__CERT")
)
_NUMBER = r"[1-9]\d{0,4}"
#: The settings of ``slurm:``: default (None: required), pattern, and meaning.
SLURM: Mapping[str, tuple[str | None, str, str]] = {
    "partition": (None, ".+", "partition (queue)"),
    "cores": (None, _NUMBER, "cores per machine, a positive whole number"),
    "memory": ("4GB", ".+", "memory per job, e.g. 60GB"),
    "machines": ("1", _NUMBER, "number of jobs at a time, one per machine"),
    "walltime": ("12:00:00", ".+", "time limit of a job, hours:minutes:seconds"),
    "account": ("", ".*", "account to charge"),
    "exclusive": ("yes", "yes|no", "yes or no: exclusive nodes"),
    "interface": ("", ".*", "network interface, e.g. ib0"),
}
#: Settings of dask that switch off its profiling of workers, which would disturb measurements.
#: docs/cluster.md has them for workers that users start.
QUIET = {"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "1s"}
_LOCAL = re.compile(r"local:([1-9]\d{0,2})")
_ADDRESS = re.compile(r"(tcp|tls)://\S+:\d+")


@dataclass(frozen=True)
class ClusterPlace:
    """A cluster, as `cluster` names it."""

    #: "local", "address" or "slurm".
    kind: str
    address: str = ""
    workers: int = 0
    settings: Mapping[str, str] = field(default_factory=dict)

    def check(self) -> None:
        """Check that what is needed is installed; no job is submitted."""
        require(Extra.CLUSTER, "a run on a cluster")
        if self.kind == "slurm" and shutil.which(SUBMIT) is None:
            raise ClusterError(
                f"{SUBMIT} is not on this machine, so no job of Slurm can be submitted from it. "
                "Use a login node, or name another cluster (docs/cluster.md)."
            )

    @property
    def is_open(self) -> bool:
        """Whether anybody who can connect to its port can run code there."""
        return self.address.startswith("tcp:")


def parse_cluster(text: str) -> ClusterPlace:
    """Parse the value of `cluster`.

    Raises
    ------
    ParameterError
        It is none of ``local:N``, ``tcp://HOST:PORT``, ``tls://HOST:PORT`` and
        ``slurm:NAME=VALUE,...``.

    Examples
    --------
    >>> parse_cluster("local:4").workers
    4
    """
    if local := _LOCAL.fullmatch(text):
        return ClusterPlace("local", workers=int(local[1]))
    if _ADDRESS.fullmatch(text):
        return ClusterPlace("address", address=text)
    if text.startswith("slurm:"):
        return ClusterPlace("slurm", settings=_settings(text))
    raise _wrong(
        text,
        "write local:4 (workers on this machine), tls://HOST:8786 or tcp://HOST:8786 (a running "
        "scheduler), or slurm:partition=cpu,cores=16,machines=10.",
    )


def _wrong(text: str, allowed: str) -> ParameterError:
    return ParameterError(f"cluster={text!r} is not allowed; {allowed}")


def _settings(text: str) -> dict[str, str]:
    given = dict(part.partition("=")[::2] for part in text.removeprefix("slurm:").split(","))
    chosen = {name: given.pop(name, usual) for name, (usual, *_) in SLURM.items()}
    problems = [f"{name!r} is unknown" for name in given]
    for name, (_, pattern, _) in SLURM.items():
        if (value := chosen[name]) is None:
            problems.append(f"{name} is missing")
        elif not re.fullmatch(pattern, value):
            problems.append(f"{name}={value} cannot be read")
    if problems:
        meanings = "; ".join(f"{name}: {meaning}" for name, (*_, meaning) in SLURM.items())
        raise _wrong(text, f"{problems[0]}: write name=value, separated by commas. {meanings}.")
    return {name: value or "" for name, value in chosen.items()}


@contextmanager
def connected(where: ClusterPlace) -> Iterator[Client]:
    """Yield a client; workers that are started here end with it.

    Raises
    ------
    MissingExtra
        dask is not installed.
    ClusterError
        The scheduler cannot be reached.
    """
    where.check()
    import dask
    from distributed import Client

    with dask.config.set(QUIET), ExitStack() as stack:
        if where.kind == "address":
            client = _client_of(where.address)
        else:
            start = _local if where.kind == "local" else _slurm
            client = Client(stack.enter_context(start(where)), set_as_default=False)
        yield stack.enter_context(client)


def _client_of(address: str) -> Client:
    from distributed import Client

    try:
        return Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, RuntimeError, TimeoutError, TypeError, ValueError) as error:
        raise ClusterError(
            f"no scheduler answers at {address}: {error or 'timed out'}. Start one with `dask "
            "scheduler`, and workers with `dask worker ADDRESS --nthreads 1`; for TLS, set "
            f"{', '.join(TLS_VARIABLES)} to the files of the certificates."
        ) from error


def quiet_variables() -> dict[str, str]:
    """Return :data:`QUIET` as environment variables, for workers that are started elsewhere."""
    return {
        f"DASK_{name.upper().replace('-', '_').replace('.', '__')}": str(value)
        for name, value in QUIET.items()
    }


def _local(where: ClusterPlace) -> Any:
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=where.workers,
        threads_per_worker=1,
        memory_limit=0,
        silence_logs=logging.CRITICAL,
        host="127.0.0.1",
        protocol="tls://",
        security=True,
        dashboard_address=_PAGES,
        local_directory=str(place() / "dask"),
        preload=["cembench.running.cluster.worker"],
    )


def refusals(cluster: Any) -> Sequence[str]:
    """Return what Slurm said of the jobs that it refused, one for each."""
    return getattr(cluster, "refusals", ())


def _job_class(refused: list[str]) -> type:
    """Return the class of a job; one that cannot be submitted adds the cause and starts nothing."""
    from dask_jobqueue.slurm import SLURMJob

    class Job(SLURMJob):  # type: ignore[misc] # dask_jobqueue has no types
        async def _submit_job(self, script: str) -> str:
            try:
                return str(await super()._submit_job(script))
            except (OSError, RuntimeError) as error:
                refused.append(" ".join(str(error).split()))
                self.cancel_command = "true"
                return "no job, number 0"

    return Job


def _slurm(where: ClusterPlace) -> Any:
    from dask_jobqueue import SLURMCluster

    chosen, refused = where.settings, list[str]()
    logs = place() / "slurm"
    logs.mkdir(parents=True, exist_ok=True)
    cluster = SLURMCluster(
        queue=chosen["partition"],
        account=chosen["account"] or None,
        cores=int(chosen["cores"]),
        memory=chosen["memory"],
        walltime=chosen["walltime"],
        interface=chosen["interface"] or None,
        processes=1,
        python=sys.executable,
        security=True,
        shared_temp_directory=str(logs),  # for the workers' certificates, readable to this user
        worker_extra_args=["--no-dashboard", "--dashboard-address", _PAGES],
        job_extra_directives=["--exclusive"] if chosen["exclusive"] == "yes" else [],
        job_script_prologue=[f"export {name}={value}" for name, value in quiet_variables().items()],
        job_name="cembench",
        local_directory=str(place() / "dask"),
        log_directory=str(logs),
        scheduler_options={"dashboard_address": _PAGES},
        job_cls=_job_class(refused),
    )
    cluster.refusals = refused
    try:
        wanted = int(chosen["machines"])
        cluster.adapt(minimum_jobs=wanted, maximum_jobs=wanted)  # a job that ends is replaced
    except BaseException:
        cluster.close()
        raise
    return cluster

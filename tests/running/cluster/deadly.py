"""An algorithm that ends the worker that measures it."""

import time

import psutil

from cembench import DiskMesh, Parameterization, algorithm


@algorithm("ends-the-worker", title="Ends the worker", target="disk")
def ends_the_worker(mesh: DiskMesh) -> Parameterization:
    _worker().kill()
    time.sleep(600)


def _worker() -> psutil.Process:
    """Return the dask worker; between it and a call may be a fork server."""
    ours = ("cembench.running.fork_server", "cembench.running.worker")
    this = psutil.Process()
    return next(one for one in this.parents() if not set(ours) & set(one.cmdline()))

"""Algorithms that end what measures them."""

import time

import psutil

from cembench import DiskMesh, Parameterization, algorithm


@algorithm("ends-the-worker", title="Ends the worker", target="disk")
def ends_the_worker(mesh: DiskMesh) -> Parameterization:
    _measurer().parent().kill()
    time.sleep(600)


@algorithm("ends-the-measurer", title="Ends the measurer", target="disk")
def ends_the_measurer(mesh: DiskMesh) -> Parameterization:
    _measurer().kill()
    time.sleep(600)


def _measurer() -> psutil.Process:
    """Return the measuring process of the worker; between it and a call may be a fork server."""
    (found,) = (
        one
        for one in psutil.Process().parents()
        if "cembench.running.cluster.measure" in one.cmdline()
    )
    return found

"""Algorithms that end what measures them."""

import time

import psutil

from cembench import DiskMesh, Parameterization, algorithm


@algorithm("ends-the-worker", title="Ends the worker", target="disk")
def ends_the_worker(mesh: DiskMesh) -> Parameterization:
    psutil.Process().parents()[1].kill()
    time.sleep(600)


@algorithm("ends-the-measurer", title="Ends the measurer", target="disk")
def ends_the_measurer(mesh: DiskMesh) -> Parameterization:
    psutil.Process().parents()[0].kill()
    time.sleep(600)

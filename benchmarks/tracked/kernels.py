"""Seconds of the steps that all algorithms share."""

from __future__ import annotations

from . import cases


class Kernels:
    """One shared step on a spherical cap."""

    version = "1"
    params = (cases.KERNELS, cases.FACES)
    param_names = ("kernel", "faces")
    warmup_time = 0.1
    repeat = (5, 15, 3.0)

    def setup(self, kernel: str, faces: int) -> None:
        self.call = cases.kernels(cases.surface("spherical-cap", faces))[kernel]

    def time_kernel(self, kernel: str, faces: int) -> None:
        self.call()


if cases.everything_is_asked_for():

    class MoreKernels(Kernels):
        """The same up to larger surfaces."""

        params = (cases.KERNELS, cases.MORE_FACES)

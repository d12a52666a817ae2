"""Seconds, memory and quality of every algorithm over kinds and sizes of surface."""

from __future__ import annotations

from cembench.metrics import all_metrics

from . import cases


class _Algorithms:
    """An algorithm with its defaults on a surface; every figure is better when lower."""

    #: An edited benchmark keeps its history until this changes.
    version = "1"
    param_names = ("algorithm", "surface", "faces")
    warmup_time = 0.1
    repeat = (3, 7, 4.0)
    timeout = 300.0

    def setup(self, algorithm: str, surface: str, faces: int) -> None:
        if not cases.is_asked_for(surface, faces):
            raise NotImplementedError(f"{surface} at {faces}: set {cases.VARIABLE}=all")
        self.mesh = cases.surface(surface, faces)
        self.call = cases.mapping(algorithm, self.mesh)

    def time_map(self, algorithm: str, surface: str, faces: int) -> None:
        self.call()

    def peakmem_map(self, algorithm: str, surface: str, faces: int) -> None:
        self.call()

    def track_conformal_energy(self, algorithm: str, surface: str, faces: int) -> float:
        return float(all_metrics(self.mesh, self.call().uv)["conformal_energy"])

    def track_angle_error(self, algorithm: str, surface: str, faces: int) -> float:
        return float(all_metrics(self.mesh, self.call().uv)["angle_error_mean_deg"])

    def track_folds(self, algorithm: str, surface: str, faces: int) -> int:
        return int(all_metrics(self.mesh, self.call().uv)["flipped_triangles"])

    track_angle_error.unit = "degrees"  # type: ignore[attr-defined]
    track_folds.unit = "triangles"  # type: ignore[attr-defined]


class Disks(_Algorithms):
    """Algorithms that take a disk."""

    params = (cases.algorithm_names(cases.DiskMesh), cases.DISKS, cases.FACES)


class Holed(_Algorithms):
    """Algorithms that take a disk with holes."""

    params = (cases.algorithm_names(cases.HoledMesh), cases.HOLED, cases.FACES)

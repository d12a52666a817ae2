"""Seconds, memory and quality of every algorithm over kinds and sizes of surface."""

from __future__ import annotations

from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.conformal.metrics import all_metrics

from . import cases


class _Algorithms:
    """An algorithm with its defaults on a surface; every figure is better when lower."""

    #: An edited benchmark keeps its history until this changes.
    version = "1"
    param_names = ("algorithm", "surface", "faces")
    warmup_time = 0.1
    repeat = (3, 7, 4.0)
    timeout = 300.0

    def setup(self, algorithm: str, surface: str, faces: int = 0) -> None:
        self.mesh = cases.surface(surface, faces)
        self.call = cases.mapping(algorithm, self.mesh)

    def time_map(self, algorithm: str, surface: str, faces: int = 0) -> None:
        self.call()

    def peakmem_map(self, algorithm: str, surface: str, faces: int = 0) -> None:
        self.call()

    def track_conformal_energy(self, algorithm: str, surface: str, faces: int = 0) -> float:
        return float(all_metrics(self.mesh, self.call().uv)["conformal_energy"])

    def track_angle_error(self, algorithm: str, surface: str, faces: int = 0) -> float:
        return float(all_metrics(self.mesh, self.call().uv)["angle_error_mean_deg"])

    def track_folds(self, algorithm: str, surface: str, faces: int = 0) -> int:
        return int(all_metrics(self.mesh, self.call().uv)["flipped_triangles"])

    track_angle_error.unit = "degrees"  # type: ignore[attr-defined]
    track_folds.unit = "triangles"  # type: ignore[attr-defined]


class Disks(_Algorithms):
    """Algorithms that take a disk."""

    params = (cases.algorithm_names(DiskMesh), cases.DISKS, cases.FACES)


class Field(_Algorithms):
    """The field's other algorithms that take a disk."""

    params = (cases.field_names(), cases.DISKS, cases.FACES[:1])


if cases.real_disks():

    class RealDisks(_Algorithms):
        """Algorithms that take a disk, on real ones."""

        params = (
            [*cases.algorithm_names(DiskMesh), *cases.field_names()],
            cases.real_disks(),
        )
        param_names = ("algorithm", "surface")

        def setup(self, algorithm: str, surface: str, faces: int = 0) -> None:
            """Read the surface."""
            self.mesh = cases.real_disk(surface)
            self.call = cases.mapping(algorithm, self.mesh)


class Holed(_Algorithms):
    """Algorithms that take a disk with holes."""

    params = (cases.algorithm_names(HoledMesh), cases.HOLED, cases.FACES)


if cases.everything_is_asked_for():

    class MoreDisks(_Algorithms):
        """More kinds of surface, up to larger ones."""

        params = (cases.algorithm_names(DiskMesh), cases.MORE_DISKS, cases.MORE_FACES)

    class MoreHoled(_Algorithms):
        """More kinds of surface, up to larger ones."""

        params = (cases.algorithm_names(HoledMesh), cases.MORE_HOLED, cases.MORE_FACES)

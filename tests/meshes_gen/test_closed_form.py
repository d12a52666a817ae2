"""Surfaces whose conformal map is known: the map is conformal, better so on finer meshes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from cembench.surfaces import cone, holed, sheets, spherical_cap
from numpy.typing import NDArray

from cembench.conformal.metrics import all_metrics
from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

Case = Callable[[int], tuple[TriangleMesh, NDArray[np.complex128]]]
QUARTERS = np.deg2rad(270)


def _cap(faces: int) -> tuple[TriangleMesh, NDArray[np.complex128]]:
    mesh = spherical_cap.spherical_cap(faces, angle=120.0)
    return mesh, spherical_cap.exact_map(mesh.V, 120.0)


def _cone(faces: int) -> tuple[TriangleMesh, NDArray[np.complex128]]:
    mesh = cone.cone(faces, angle=50.0)
    return mesh, cone.exact_map(mesh.V, 50.0)


CASES: dict[str, Case] = {
    "spherical cap": _cap,
    "cone": _cone,
    "cylinder": lambda n: (sheets.cylinder_sheet(n), sheets.exact_map(n, QUARTERS / 2)),
    "swiss roll": lambda n: (sheets.swiss_roll(n, aspect=3.0), sheets.exact_map(n, 3.0)),
    "catenoid sheet": lambda n: (sheets.catenoid_sheet(n), sheets.exact_map(n, QUARTERS / 2)),
}


@pytest.mark.parametrize("case", CASES)
def test_exact_map_is_conformal_to_the_disk(case: str) -> None:
    errors = []
    for faces in (2_000, 8_000, 32_000):
        mesh, uv = CASES[case](faces)
        figures = all_metrics(mesh, uv)
        assert not mesh.notices
        assert abs(mesh.m / faces - 1) < 0.07
        assert figures["flipped_triangles"] == 0
        assert figures["boundary_circularity"] < 1e-9
        errors.append(figures["conformal_energy"])
    # E_C falls like the square of the edge length: by 4 when the count grows by 4.
    rate = np.polyfit(np.log([2_000, 8_000, 32_000]), np.log(errors), 1)[0]
    print(case, errors, rate)
    assert rate < -0.8


@pytest.mark.parametrize("height", [0.5, 2.0])
def test_catenoid_ring_has_the_modulus_of_its_height(height: float) -> None:
    mesh = sheets.catenoid_ring(8_000, height=height)
    w = sheets.ring_map(mesh.V)
    radii = sorted(float(np.abs(w[loop]).mean()) for loop in mesh.loops)
    assert radii[1] / radii[0] == pytest.approx(np.exp(height))
    figures = all_metrics(mesh, w)
    assert figures["flipped_triangles"] == 0
    assert figures["angle_error_mean_deg"] < 1.5


@pytest.mark.parametrize(
    "holes",
    [k if k in (1, 3, 8) else pytest.param(k, marks=pytest.mark.slow) for k in range(1, 9)],
)
def test_cap_with_holes(holes: int, tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    mesh = holed.holed_cap(3_000, holes=holes)
    assert len(mesh.loops) == holes + 1
    assert mesh.m == 3_000
    figures = all_metrics(mesh, holed.exact_map(mesh.V))
    assert figures["boundary_circularity"] < 1e-8
    assert figures["flipped_triangles"] == 0
    assert figures["angle_error_mean_deg"] < 1.5


@pytest.mark.slow
def test_hos_face_has_three_holes(tmp_path: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    mesh = holed.ho_face_with_holes(8_000)
    assert len(mesh.loops) == 4
    assert mesh.m == 8_000


def test_exact_map_refuses_a_sliver() -> None:
    with pytest.raises(ParameterError, match=r"0\.2 to 20"):
        sheets.exact_map(2_000, 100.0)


def test_sheets_are_isometric_to_their_rectangle() -> None:
    for mesh in (sheets.cylinder_sheet(20_000), sheets.swiss_roll(20_000)):
        assert isinstance(mesh, DiskMesh)
        corners = mesh.V[mesh.F]
        area = (
            0.5
            * np.linalg.norm(
                np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
            ).sum()
        )
        wanted = QUARTERS * 2 if mesh.name == "cylinder-sheet" else 6.0
        assert area == pytest.approx(wanted, rel=2e-3)

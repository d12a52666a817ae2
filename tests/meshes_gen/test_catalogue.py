"""Every stand-in is held to its row of the paper's Table 2."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cembench.algorithms.cem import cem
from cembench.surfaces import catalogue
from cembench.surfaces.faces import EXPRESSIONS
from cembench.surfaces.head import Head
from cembench.surfaces.remesh import march
from cembench.surfaces.rows import ROWS

from cembench.conformal.laplacian import non_delaunay_share
from cembench.conformal.metrics import flipped_triangles
from cembench.core.errors import ParameterError, RegistryError
from cembench.core.notices import NoticeKind
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, load_registry
from cembench.report.surface_facts import factor_spans, row_check
from cembench.results.profiles import Profile, surfaces_of
from cembench.running.plan import Provenance, mesh_facts

#: Made in seconds; the others are for the slow run.
QUICK = ("nefertiti-stand-in", "cowboy-hat-stand-in", "chinese-vase-stand-in")
#: Their conformal factor spans three orders of magnitude (ratio of extreme length factors).
HARD = (
    "foot-stand-in",
    "stanford-bunny-stand-in",
    "human-brain-stand-in",
    "left-hand-stand-in",
    "statue-of-liberty-stand-in",
    "isis-statue-stand-in",
    "bimba-statue-stand-in",
)
ALL = [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in ROWS]


@pytest.fixture(scope="module", autouse=True)
def fresh_cache(tmp_path_factory: pytest.TempPathFactory) -> object:
    """A cache of these tests' own: what is tested is what the generators make now."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CEMBENCH_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def _check(name: str, mesh: DiskMesh) -> dict[str, Any]:
    check = row_check(mesh_facts(mesh, Provenance(ROWS[name].model, "stand-in")))
    assert check is not None
    return check


def _tilt(mesh: DiskMesh) -> float:
    """Share of the area that faces away from the direction most of the surface faces."""
    a, b, c = (mesh.V[mesh.F[:, k]] for k in range(3))
    N = np.cross(b - a, c - a)
    mean = N.sum(axis=0)
    size = np.linalg.norm(N, axis=1)
    return float(size[N @ mean < 0].sum() / size.sum())


#: Other kernels of BLAS, loops of numpy and functions of the C library: an older processor's.
OLDER = {
    "OPENBLAS_CORETYPE": "Nehalem",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F",
}


@pytest.mark.process
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="needs an x86 processor")
@pytest.mark.parametrize("name", ALL[:-2])  # the two largest take ten minutes
def test_an_older_processor_makes_the_same_mesh(name: str, tmp_path: Path) -> None:
    code = f"from cembench.surfaces import catalogue; print(catalogue.stand_in({name!r}).hash)"
    older = os.environ | OLDER | {"CEMBENCH_CACHE": str(tmp_path)}
    command = [sys.executable, "-W", "ignore", "-c", code]
    made = subprocess.run(command, env=older, capture_output=True, text=True, check=True)
    assert made.stdout.split() == [catalogue.stand_in(name).hash]


@pytest.mark.parametrize("name", ALL)
def test_stand_in_meets_its_row(name: str) -> None:
    mesh = catalogue.stand_in(name)
    check = _check(name, mesh)
    assert abs(check["faces_off"]) <= 0.01
    assert abs(check["boundary_off"]) <= 0.10
    assert check["ok"]
    assert mesh.notices == ()
    assert non_delaunay_share(mesh) < ROWS[name].levers.non_delaunay + 2e-3
    # Not a height field over a disk: in no direction does the whole surface face one way. Models
    # that are: Nefertiti and the hat.
    assert _tilt(mesh) > 0.002 or name in ("nefertiti-stand-in", "cowboy-hat-stand-in")
    uv = cem(mesh).uv
    assert flipped_triangles(mesh, uv) == 0
    if name in HARD:
        spans = factor_spans(mesh, uv)
        assert spans["conformal_factor_span"] >= 1e3
        assert spans["conformal_factor_span_99_8"] >= 1e3


def test_rows_are_in_the_registry_under_their_models_names() -> None:
    surfaces = load_registry().surfaces
    for name, row in ROWS.items():
        assert surfaces[name].title == row.model
        defaults = {p.name: p.default for p in surfaces[name].parameters}
        assert defaults == {"faces": row.faces, "seed": 0, **asdict(row.levers)}
    assert len(ROWS) == 20


def test_boundaries_follow_from_table_2() -> None:
    assert ROWS["nefertiti-stand-in"].boundary == 34
    assert ROWS["chinese-lion-stand-in"].boundary == 245
    assert ROWS["left-hand-stand-in"].boundary == 246
    assert ROWS["bimba-statue-stand-in"].boundary == 1160


def test_same_seed_same_bytes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    first = catalogue.stand_in("chinese-vase-stand-in", 2_000)
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    assert catalogue.stand_in("chinese-vase-stand-in", 2_000).hash == first.hash
    assert catalogue.stand_in("chinese-vase-stand-in", 2_000, seed=1).hash != first.hash


@pytest.mark.parametrize("faces", [1_000, 9_001])
def test_any_size(faces: int) -> None:
    mesh = catalogue.stand_in("cowboy-hat-stand-in", faces)
    assert abs(mesh.m - faces) <= 1
    assert mesh.notices == ()


def test_another_route_without_pymeshlab(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cembench.surfaces.remesh.has_remeshing_filter", lambda: False)
    monkeypatch.setattr("cembench.surfaces.catalogue.has_remeshing_filter", lambda: False)
    mesh = catalogue.stand_in("cowboy-hat-stand-in")
    notice, *_ = mesh.notices
    assert notice.kind is NoticeKind.REMESHED_WITHOUT_FILTER
    assert "doctor" in notice.text
    assert _check("cowboy-hat-stand-in", mesh)["ok"]


def test_unknown_stand_in_lists_the_known() -> None:
    with pytest.raises(RegistryError, match=r"unknown stand-in 'teapot'; known: nefertiti-st"):
        catalogue.stand_in("teapot")


@pytest.mark.slow
def test_landmarks_of_the_four_expressions() -> None:
    places = {}
    for expression in ("neutral", "smile", "pouting", "wry"):
        name = f"liu-{expression}-face-stand-in"
        mesh = catalogue.stand_in(name, 20_000)
        marks = catalogue.landmarks(name, mesh)
        assert len(marks) == len(set(marks.values())) == 10
        places[expression] = {key: mesh.V[vertex] for key, vertex in marks.items()}
    neutral, smile = places["neutral"], places["smile"]
    assert np.linalg.norm(neutral["nose_tip"] - smile["nose_tip"]) < 0.04  # the same person
    assert smile["mouth_corner_left"][2] > neutral["mouth_corner_left"][2] + 0.05
    wry = places["wry"]
    assert wry["mouth_corner_right"][2] > wry["mouth_corner_left"][2] + 0.1
    assert wry["mouth_corner_right"][0] < wry["lips_right"][0] < wry["lips_middle"][0]


def test_only_faces_have_landmarks() -> None:
    with pytest.raises(RegistryError, match="'foot-stand-in' has no landmarks"):
        catalogue.landmarks("foot-stand-in", catalogue.stand_in("nefertiti-stand-in"))


def test_the_quick_profile_takes_the_stand_ins_of_the_eight_smallest_models() -> None:
    assert surfaces_of(Profile.quick, load_registry()) == list(ROWS)[:8]


def test_pouting_lips_leave_no_tunnel_to_plug(monkeypatch: pytest.MonkeyPatch) -> None:
    plugged: list[object] = []
    monkeypatch.setattr("cembench.surfaces.remesh.plugs_for", lambda *a: plugged.append(a))
    march(catalogue.BODIES["ho-pouting-face-stand-in"](0))
    assert not plugged


@pytest.mark.parametrize("name", list(catalogue.FACES))
def test_landmarks_lie_on_the_surface(name: str) -> None:
    body, (person, expression) = catalogue.BODIES[name](0), catalogue.FACES[name]
    points = Head(person, EXPRESSIONS[expression], ears=False).landmarks()
    assert len(points) == 10
    for key, point in points.items():
        assert abs(body.f(point[None])[0]) < 0.04, key  # heads are 1.5 wide


def test_landmarks_of_faces_are_found_through_the_registry() -> None:
    surfaces = load_registry().surfaces
    mesh = catalogue.stand_in("nefertiti-stand-in")  # any mesh will do; this one is made fast
    for name in catalogue.FACES:
        find = surfaces[name].landmarks
        assert find is not None
        assert find(mesh) == catalogue.landmarks(name, mesh)
    assert surfaces["foot-stand-in"].landmarks is None


def test_no_family_makes_more_triangles_than_memory_holds() -> None:
    families = load_registry().surfaces
    made = [name for name in families if name != "ict-face"]  # the model has 28,068 at most
    for name in made:
        families[name].arguments({"faces": MAX_FACES})
        with pytest.raises(ParameterError, match="less than or equal to 4000000"):
            families[name].arguments({"faces": 10**9})
    assert len(made) > 20

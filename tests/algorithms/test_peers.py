"""Algorithms of others: each maps a surface that is easy, or is skipped with its reason."""

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.holed_disk import holed_disk

from cembench import DiskMesh, HoledMesh, parameterize
from cembench.mesh.uvs import read_flat
from cembench.registry import load_registry
from cembench.running.external.exchange import read_output
from cembench.running.external.installed import missing
from cembench.running.measure import check_cell
from cembench.running.plan import MeasurementSettings, plan_cells
from tests.real_meshes import real_mesh

REGISTRY = load_registry()
EASY = hemi_ellipsoid(600)


def outcome_of(name, mesh=EASY):
    peer = REGISTRY.algorithm(name)
    lacking = missing(peer)
    if lacking:
        pytest.skip(f"{name}: {lacking}")
    (task,) = plan_cells([peer], [mesh], {}, MeasurementSettings(repeats=1))
    return check_cell(peer, mesh, task.cell)


@pytest.mark.parametrize("name", list(REGISTRY.peers))
def test_an_easy_surface_is_mapped_and_the_version_is_known(name):
    mesh = holed_disk(600) if REGISTRY.peers[name].mesh_type is HoledMesh else EASY
    outcome, uv = outcome_of(name, mesh)
    assert outcome.status == "ok", outcome.cause
    program = REGISTRY.peers[name].program
    assert bool(outcome.program.version) == (program is None or bool(program.version))
    target = REGISTRY.peers[name].target
    assert len(uv) == (3 * mesh.m if target == "atlas" else mesh.n)
    if target == "atlas":
        assert outcome.metrics["islands"] >= 1
    assert outcome.metrics["angle_error_mean_deg"] < 15


def test_peers_are_no_part_of_a_run_that_does_not_name_them():
    assert not REGISTRY.peers.keys() & REGISTRY.algorithms.keys()
    assert {"igl-lscm", "xatlas", "blender-conformal", "bff-program"} <= REGISTRY.peers.keys()


@pytest.mark.parametrize("name", ["nefertiti", "turtle"])
def test_libigls_lscm_is_ours_on_real_surfaces(name):
    ours = parameterize(real_mesh(f"{name}.obj"), "lscm")
    _, theirs = outcome_of("igl-lscm", ours.mesh)
    if ours.extras.get("fold_repairs"):
        pytest.skip("ours was repaired where it folded, and theirs was not")
    assert np.abs(ours.z - theirs).max() < 1e-6


def test_libigls_harmonic_map_is_ours_and_meshlabs_is_it_in_single_precision():
    ours = parameterize(EASY, "harmonic-circle").z
    for name, digits in (("igl-harmonic", 1e-9), ("meshlab-harmonic", 1e-5)):
        _, theirs = outcome_of(name)
        turned = theirs * (ours[EASY.boundary[0]] / theirs[EASY.boundary[0]])
        assert np.abs(turned - ours).max() < digits, name


def test_the_formats_of_programs_that_are_not_here_are_read(tmp_path):
    """BFF writes a UV for each corner with six digits, OpenABF the flattened surface."""
    mesh = DiskMesh.from_arrays(EASY.V, EASY.F)
    uv = parameterize(mesh, "harmonic-circle").z
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.V]
    corners = uv[mesh.F].ravel() * 0.5 + (0.5 + 0.5j)
    lines += [f"vt {z.real:.6g} {z.imag:.6g}" for z in corners]
    faces = enumerate((mesh.F + 1).tolist())
    lines += [f"f {a}/{3 * k + 1} {b}/{3 * k + 2} {c}/{3 * k + 3}" for k, (a, b, c) in faces]
    (tmp_path / "bff.obj").write_text("\n".join(lines))
    result = read_output(tmp_path / "bff.obj", REGISTRY.algorithm("bff-program-disk"), mesh)
    assert np.abs(result.uv - uv).max() < 1e-5
    lines = [f"v {z.real!r} {z.imag!r} 0" for z in uv.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.F + 1).tolist()]
    (tmp_path / "flat.obj").write_text("\n".join(lines))
    assert np.array_equal(read_flat(tmp_path / "flat.obj").uv, uv)
    result = read_output(tmp_path / "flat.obj", REGISTRY.algorithm("openabf"), mesh)
    assert np.array_equal(result.uv, uv)

"""Section 4 of the paper, on surfaces where its premises hold and where they do not."""

import json

import numpy as np
import pytest
from cembench.papers.cem import theory_facts
from cembench.papers.cem.boundary_operator import (
    TOLERANCE,
    BoundaryOperator,
    predicted_rate,
    premises,
    statements,
    trajectory,
)
from cembench.papers.cem.theory_facts import _rival_history
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh, Parameterization, algorithm
from cembench.core.errors import AlgorithmFailed
from cembench.results.exhibits import read_exhibits
from tests import gallery
from tests.real_meshes import real_mesh


@pytest.fixture(scope="module")
def K():
    return BoundaryOperator(flat_disk(2000))


@pytest.fixture(scope="module")
def paths(K):
    return [trajectory(K, 200, inversion=inversion) for inversion in (False, True)]


def by_name(checks):
    return {check.name: check for check in checks}


def test_on_a_well_conditioned_delaunay_mesh_every_statement_holds(K, paths):
    assert all(check.holds for check in premises(K))
    found = by_name(statements(K, *paths, dense=True))
    assert len(found) == 16
    assert all(check.holds for check in found.values())
    for name in ("K 1 = 1", "spectral radius is 1", "centralisation: C K 1 = 0"):
        assert found[name].figure < TOLERANCE
    assert found["K > 0"].figure > 0


def test_K_is_what_its_formula_says(K):
    mesh = K.mesh
    i, b = mesh.interior, mesh.boundary
    L = K.L.toarray()
    expected = np.linalg.solve(
        L[np.ix_(b, b)], L[np.ix_(b, i)] @ np.linalg.solve(L[np.ix_(i, i)], L[np.ix_(i, b)])
    )
    np.testing.assert_allclose(K.dense, expected, atol=1e-12)
    v = np.random.default_rng(0).normal(size=len(b))
    np.testing.assert_allclose(K(v), expected @ v, atol=1e-12)
    np.testing.assert_allclose(
        K.spectrum(), np.sort(np.linalg.eigvals(expected).real)[::-1], atol=1e-10
    )


def test_the_gap_of_K_predicts_the_speed_of_the_iteration_on_a_surface_of_revolution(K, paths):
    values, _ = K.leading_eigenpairs()
    assert paths[0].rate == pytest.approx(predicted_rate(values), abs=2e-4)


def test_a_stretched_disk_with_obtuse_triangles_breaks_the_signs_and_says_so():
    K = BoundaryOperator(flat_disk(600, stretch=4.0))
    given = by_name(premises(K))
    assert not given["interior edges are Delaunay: L_ij < 0"].holds
    assert given["(i) the mesh is connected"].holds
    paths = [trajectory(K, 30, inversion=inversion) for inversion in (False, True)]
    found = by_name(statements(K, *paths, dense=True))
    assert found["K 1 = 1"].holds  # needs no sign
    assert not found["K > 0"].holds


def test_ears_break_definition_1():
    V, F = gallery.flat_rectangle()
    statements = by_name(premises(BoundaryOperator(DiskMesh.from_arrays(V, F))))
    assert not statements["(iv) each boundary vertex has an interior neighbour"].holds


def test_a_mesh_without_interior_has_no_K():
    strip = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 6))
    with pytest.raises(AlgorithmFailed, match="no interior vertex"):
        BoundaryOperator(strip)


def test_the_chinese_lion_loses_positivity_and_nothing_else(cli):
    code, out, _ = cli("theory", real_mesh("chinese_lion.obj"), "--json", "--run", "r")
    (facts,) = json.loads(out)
    assert code == 0  # a statement may fail where its premise does
    assert not facts["premises_hold"]
    failed = {check["name"] for check in facts["statements"] if not check["holds"]}
    assert failed == {"K > 0"}
    least = {row["name"]: row["last"] for row in facts["energies"]}
    assert least["Direct CEM"] < min(least["CEM, step (23)"], least["CEM, step (30)"])
    (exhibit,) = read_exhibits(cli.folder / "r")
    assert exhibit.name == "theory-chinese_lion"
    assert "K > 0" in exhibit.text


def test_the_verb_shows_and_lays_down_an_exhibit(cli):
    code, out, _ = cli("theory", "flat-disk", "--faces", 600, "--iterations", 30, "--run", "r")
    assert code == 0
    assert "All premises hold. All 16 statements hold." in out.replace("\n", " ")
    assert max(map(len, out.splitlines()[:-1])) <= 80
    (exhibit,) = read_exhibits(cli.folder / "r")
    assert (cli.folder / "r/exhibits/theory-flat-disk/theory.png").stat().st_size > 10_000
    assert exhibit.tables[1].rows[0][:3] == ("K 1 = 1", "Theorem 2", "yes")


def test_in_python_too_the_exhibit_names_the_command_that_makes_it_again(tmp_path):
    import cembench

    result = cembench.theory("flat-disk", faces=100, iterations=10, run=tmp_path / "r")
    (exhibit,) = read_exhibits(tmp_path / "r")
    assert exhibit.command == "cembench theory flat-disk --iterations 10 --faces 100"
    assert exhibit.facts["vertices"] == result.facts["vertices"]
    assert exhibit.origin == "surface"


def test_the_exhibit_of_a_stand_in_says_so(tmp_path):
    import cembench

    cembench.theory("cowboy-hat-stand-in", faces=400, iterations=5, run=tmp_path / "r")
    assert read_exhibits(tmp_path / "r")[0].origin == "stand-in"


def test_another_algorithms_course_stands_beside_cems_where_it_is_installed():
    mesh = flat_disk(100)

    def rival(energies, failing=False):
        @algorithm("rival", title="Rival", target="disk")
        def solver(
            mesh: DiskMesh, *, delaunay: bool = True, back: float = 0.01
        ) -> Parameterization:
            assert (delaunay, back) == (False, 0)  # the least energy with K's own weights
            if failing:
                raise AlgorithmFailed("no luck")
            return Parameterization(np.zeros(mesh.n, complex), 1, energies)

        return solver.__cembench__

    assert _rival_history(rival((0.2, 0.1)), mesh) == ({"Rival": (0.2, 0.1)}, "")
    assert _rival_history(rival(()), mesh)[1] == "Rival reports no energies."
    assert _rival_history(rival((), failing=True), mesh)[1] == "Rival failed: no luck."
    assert _rival_history(None, mesh) == ({}, "direct-cem is not installed here.")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "is neither a file nor a registered surface"),
        (["nowhere.obj"], "there is no such file"),
        (["tube.obj"], "2 boundary loops"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(arguments, message, cli):
    (cli.folder / "tube.obj").write_text(gallery.obj_text(*gallery.tube()))
    code, out, err = cli("theory", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert [path.name for path in cli.folder.iterdir()] == ["tube.obj"]


def test_the_certificate_is_told_in_json_and_in_eighty_columns(cli):
    arguments = ["theory", "spherical-cap", "--faces", "600", "--iterations", "60"]
    code, out, _ = cli(*arguments, "--json")
    assert code == 0
    found = json.loads(out)[0]["certificate"]
    assert found["lower"] < found["modulus"] < found["upper"]
    assert found["reciprocal_error"] == pytest.approx(found["upper"] / found["lower"] - 1)
    start, end = found["off"]["CEM, start"], found["off"]["CEM, step (30)"]
    assert abs(end) < 2e-3 < abs(start) < 0.05
    code, out, _ = cli(*arguments)
    assert code == 0
    table = out[out.index("four boundary points") :]
    assert f"{found['lower']:.5f}" in table
    assert f"{found['off']['CEM, start']:+.1e}" in table
    items = [line for line in out.splitlines() if not line.startswith("Exhibits")]
    assert max(map(len, items)) <= 80


def test_a_surface_without_four_boundary_points_has_no_certificate():
    V = np.array([[0, 0, 0], [4, 0, 0], [2, 3, 0], [2, 1, 0]], float)
    mesh = DiskMesh.from_arrays(V, np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    assert "four are needed" in theory_facts._certificate(mesh, {}, None)["missing"]

"""Tables of maps' quality: each on a surface of its kind, small enough for a test."""

from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.holed_disk import holed_disk

from benchmarks import (
    cut_surfaces,
    direct_cem_quality,
    fold_repairs,
    koebe_sweeps,
    rates,
    validated,
)
from cembench.mesh.files import write_mesh
from tests import gallery
from tests.hard_surfaces import hard_surface


def rows(section):
    return section.parts[-1].rows


def test_a_torus_is_cut_and_mapped(tmp_path):
    (tmp_path / "ring.obj").write_text(gallery.obj_text(*gallery.torus()))
    (row,) = rows(cut_surfaces.cut_surfaces([tmp_path / "ring.obj"]))
    assert (row["surface"], row["genus"], row["folds"]) == ("ring", 1, 0)
    assert row["edges"] > 4


def test_sweeps_are_counted_until_one_more_gives_little(tmp_path):
    write_mesh(tmp_path / "ring.obj", holed_disk(300, holes=1))
    found = rows(koebe_sweeps.koebe_sweeps([tmp_path / "ring.obj"], most=3))
    once, *more = found
    assert once["sweeps"] == 1
    assert len(more) <= 1
    assert all(one["energy"] < once["energy"] and one["sweeps"] <= 3 for one in more)
    assert all(one["folds"] == 0 and one["off"] > 0 for one in found)


def test_only_maps_with_folds_are_tabulated_with_what_the_repair_did(tmp_path):
    write_mesh(tmp_path / "hard.obj", hard_surface(0))
    write_mesh(tmp_path / "plain.obj", flat_disk(300))
    found = rows(fold_repairs.fold_repairs([tmp_path]))
    assert {one["surface"] for one in found} == {"hard"}
    for one in found:
        assert one["folds"] > 0
        assert one["left"] in ("0", "refused")
        assert one["after"] != one["before"]


def test_methods_are_multiples_of_the_best_of_the_papers():
    section = direct_cem_quality.direct_cem_quality(["nefertiti-stand-in@400"])
    own = {one["method"]: one for one in rows(section) if one["weights"] == "own"}
    best = min(own[name]["angle"]["mean"] for name in direct_cem_quality.PAPER)
    assert best == 1
    assert own["Direct CEM"]["angle"]["mean"] < own["Direct CEM, `back=0`"]["angle"]["mean"]
    assert own["Direct CEM, `back=0`"]["energy"]["mean"] <= own["Direct CEM"]["energy"]["mean"]


def test_what_validate_finds_of_a_free_boundary_has_no_modulus():
    (row,) = rows(validated.validated(["lscm"]))
    assert row["verdict"] == "valid"
    assert 1.9 < row["energy0"] < 2.1
    assert row["off0"] is None


def test_on_a_flat_disk_the_rate_is_the_predicted_one():
    (row,) = rates.rates(["flat-disk@600"]).parts[0].rows
    assert abs(row["plain"] - row["predicted"]) < 1e-3

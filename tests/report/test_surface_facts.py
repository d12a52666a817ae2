import json
from dataclasses import replace
from pathlib import Path

import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import DiskMesh, RegistryError, registry, surface_family
from cembench.core.errors import RecordError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.files import write_mesh
from cembench.registry import Registry, load_registry
from cembench.report import surface_facts
from cembench.report.surface_facts import factor_spans, find_facts, kept_facts, row_check
from cembench.results.records import MeshFacts


@pytest.fixture
def known(tmp_path, monkeypatch):
    """A registry of one surface that stands for a row of the paper and is kept on disk."""

    def place(faces):
        return tmp_path / f"bowl-{faces}.ply"

    @surface_family("bowl", title="Bowl", paper_row="Nefertiti", kept=place)
    def bowl(faces: int = 562) -> DiskMesh:
        mesh = hemi_ellipsoid(faces)
        write_mesh(place(faces), mesh)
        return mesh

    found = Registry(load_registry().algorithms, {"bowl": bowl.__cembench__})
    monkeypatch.setattr(registry, "_installed", lambda: found)
    return found


def test_facts_are_kept_beside_the_surface(known, count_calls):
    bowl = known.surface("bowl")
    assert kept_facts(known, bowl) is None
    facts = find_facts(known, bowl)
    maps = count_calls(surface_facts, "generate_surface")
    assert kept_facts(known, bowl) == facts
    assert not maps
    assert facts.mesh.origin == "stand-in"
    assert facts.metrics["flipped_triangles"] == 0
    assert facts.conformal_factor_span >= facts.conformal_factor_span_99_8 > 1
    assert Path(facts.thumbnail).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_facts_of_an_older_algorithm_or_a_damaged_file_do_not_hold(known, monkeypatch, tmp_path):
    bowl = known.surface("bowl")
    find_facts(known, bowl)
    with monkeypatch.context() as patch:
        patch.setattr(surface_facts, "code_hash", lambda algorithm: "edited")
        assert kept_facts(known, bowl) is None
    assert kept_facts(known, bowl) is not None
    place = next(tmp_path.glob("bowl-*.json"))
    place.write_bytes(place.read_bytes()[:50])
    assert kept_facts(known, bowl) is None


def test_a_surface_that_is_not_kept_has_no_facts():
    cap = load_registry().surface("spherical-cap")
    assert kept_facts(load_registry(), cap) is None
    with pytest.raises(RegistryError, match="'spherical-cap' is not stored on disk"):
        find_facts(load_registry(), cap)


def test_a_cache_that_cannot_be_written_to_is_named_before_anything_is_made(known, count_calls):
    bowl = known.surface("bowl")
    bowl.kept(562).parent.joinpath("file").write_text("in the way")
    blocked = replace(bowl, kept=lambda faces: bowl.kept(faces).parent / "file/cache/bowl.ply")
    made = count_calls(surface_facts, "generate_surface")
    with pytest.raises(
        RecordError, match=r"file/cache cannot be written to: .* Set CEMBENCH_CACHE"
    ):
        find_facts(known, blocked)
    assert not made


def test_the_span_is_a_ratio_of_lengths():
    mesh = flat_disk(2_000)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    assert factor_spans(mesh, 5 * z)["conformal_factor_span"] == pytest.approx(1)
    spans = factor_spans(mesh, (z - 0.5) / (1 - 0.5 * z))  # |f'| from 1/3 to 3 on the disk
    assert spans["conformal_factor_span"] == pytest.approx(9, rel=0.1)
    assert spans["conformal_factor_span_99_8"] < spans["conformal_factor_span"]


@pytest.mark.parametrize(
    ("changes", "ok"),
    [
        ({}, True),
        ({"faces": 567}, True),
        ({"faces": 570}, False),
        ({"boundary_vertices": 37}, True),
        ({"boundary_vertices": 38}, False),
        ({"notices": (Notice(NoticeKind.DEFINITION_1, "any words"),)}, False),
    ],
)
def test_a_surface_is_held_to_its_row_of_table_2(changes, ok):
    nefertiti = MeshFacts(
        vertices=299, faces=562, boundary_vertices=34, non_delaunay_share=0, paper_row="Nefertiti"
    )
    check = row_check(nefertiti.model_copy(update=changes))
    assert check["ok"] is ok
    assert (check["row_faces"], check["row_vertices"], check["row_boundary"]) == (562, 299, 34)
    assert row_check(nefertiti.model_copy(update={"paper_row": ""})) is None


def test_list_tells_what_is_known_and_measures_on_request(cli, known):
    code, out, _ = cli("list", "surfaces")
    assert code == 0
    assert "1 of 1 stand-ins are not measured yet" in " ".join(out.split())
    assert json.loads(cli("list", "surfaces", "--json")[1])["surfaces"][0]["facts"] is None
    code, out, err = cli("list", "surfaces", "--measure", "--json")
    assert code == 0
    assert "[1/1] bowl" in err
    facts = json.loads(out)["surfaces"][0]["facts"]
    assert facts["table2"]["row_faces"] == 562
    assert facts["conformal_factor_span"] > 1
    code, out, err = cli("list", "surfaces", "--measure")
    assert "[1/1]" not in err
    assert "thumbnails:" in out
    line = next(line for line in out.splitlines() if line.startswith("bowl ") and "%" in line)
    assert f"{facts['vertices']:,}" in line.split()
    assert max(len(line) for line in out.splitlines() if "thumbnails" not in line) <= 80


def test_measuring_goes_with_surfaces(cli):
    code, _, err = cli("list", "--measure")
    assert code == 2
    assert "leave it out, or list surfaces only." in err

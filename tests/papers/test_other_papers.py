"""Papers besides the first: what they print has its source, and their claims are decided."""

import re
from math import floor, sqrt
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
from cembench.algorithms.peers import choi_lui
from cembench.papers.ceps2021.overlay import cetm_flips_overlay
from cembench.papers.openabf.surfaces import sphere, wavy
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.holed_disk import holed_disk

from cembench.conformal.metrics import flipped_triangles
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.report.content.claims import claims
from cembench.report.content.evidence import Evidence
from cembench.report.document import Table, items_of, sections_of
from cembench.report.write_report import write_report
from cembench.results.papers import NO_PAPER, find_paper, papers, read_paper, usual_paper
from tests.papers.invented_run import write

OTHERS = sorted(papers().keys() - {"cem"})


@pytest.mark.parametrize("name", OTHERS)
def test_a_paper_has_claims_and_a_source_for_each_table(name):
    paper = find_paper(name)
    assert paper.claims
    for number, table in paper.printed.items():
        assert table.sources, number
        assert all(re.match(r"https://\S+", source) for source in table.sources)
    assert paper.surfaces.keys() <= set(paper.models)


def test_the_usual_paper_is_that_of_the_profiles():
    assert usual_paper() is papers()["cem"]
    assert min(papers()) != "cem"


def verdicts(run, name, paper=None):
    evidence = Evidence.of(run, paper or find_paper(name))
    return {claim.name: (claim.verdict, claim.figures) for claim in claims(evidence, {})}


def test_the_guide_s_paper_has_a_report(disks, tmp_path, quick_drawing):
    """Its tables print no seconds, and its model is one of the run's here."""
    page = (Path(__file__).parents[2] / "docs/papers.md").read_text()
    about, tables, stated = map(dedent, re.findall(r"```toml\n(.*?)```", page, re.DOTALL))
    mesh, folder = hemi_ellipsoid(300), tmp_path / "circles"
    folder.mkdir()
    about = about.replace("nefertiti", mesh.name).replace('"cem"', '"bff"')
    (folder / "paper.toml").write_text(about.replace("harmonic-circle", "cetm"))
    (folder / "tables.toml").write_text(tables)
    (folder / "claims.toml").write_text(
        stated.replace("harmonic-circle", "cetm").replace("cem", "bff")
    )
    (folder / "energies.csv").write_text(f"model,faces,cetm,bff\nTeapot,{mesh.m},0.5,0.4\n")
    report = write_report(disks, tmp_path / "report", "c", paper=read_paper(folder))
    table = next(table for table in items_of(report, Table) if table.name == "table-3")
    (row,) = ([value.text for value in row] for row in table.rows)
    assert (row[0], row[2], row[4]) == ("Teapot", "0.5000", "0.4000")
    assert verdicts(disks, "", read_paper(folder)).keys() == {"lower-energy"}


# OpenABF


@pytest.mark.parametrize(("make", "asked", "faces"), [
    (wavy, 50_000, 49_928), (wavy, 100_000, 99_458), (sphere, 50_000, 50_880),
])  # fmt: skip
def test_the_formulas_have_the_printed_counts(make, asked, faces):
    mesh = make(asked)
    assert mesh.m == faces
    paper = find_paper("openabf")
    assert paper.model_of(mesh.name, mesh.m) in paper.models
    assert paper.model_of(mesh.name, mesh.m + 2) == ""
    assert paper.model_of("flat-disk", mesh.m) == ""


def test_the_wavy_square_is_nearly_flat_and_the_hemisphere_round():
    mesh = wavy(800)
    k = floor(sqrt(400))
    assert (mesh.n, mesh.m) == ((k + 1) ** 2, 2 * k * k)
    assert mesh.V[:, :2].max() == k
    assert abs(np.abs(mesh.V[:, 2]).max() - 0.3) < 0.01
    cap = sphere(800)
    assert np.allclose(np.linalg.norm(cap.V, axis=1), 1, atol=1e-15)
    assert np.abs(cap.V[cap.boundary, 2]).max() < 1e-15
    rings = floor(sqrt(100)) + 1
    assert (cap.n, len(cap.boundary)) == (1 + 4 * rings**2, 4 * rings)


SMALL = {"wavy~49928f": wavy(600), "sphere~50880f": sphere(600)}


def small_openabf():
    """Return the paper with small surfaces as its models."""
    paper = find_paper("openabf")
    faces = {model: {"faces": float(mesh.m)} for model, mesh in SMALL.items()}
    tables = {
        number: {model: {**row, **faces.get(model, {})} for model, row in table.items()}
        for number, table in paper.tables.items()
    }
    return paper.model_copy(update={"tables": tables})


@pytest.fixture(scope="module")
def openabf_run(tmp_path_factory):
    seconds = {"abf++": 2.0, "lscm": 1.0}
    return write(tmp_path_factory.mktemp("openabf") / "run", SMALL.values(), seconds)


def test_openabf_s_claims_on_its_own_tables_are_decided(openabf_run):
    by_claim = verdicts(openabf_run, "openabf", small_openabf())
    assert by_claim["iterative-is-slower"][1].startswith("14 of 14 printed cells")
    assert by_claim["ratios-follow"] == ("holds", "3 of 3 ratios")
    assert by_claim["incomplete-cholesky"][0] == "holds in part"
    assert "sphere~50880f 14.56" in by_claim["incomplete-cholesky"][1]
    assert by_claim["caps-take-more"][0] == "holds"
    assert re.search(r"hemispheres \d.*; wavy squares \d", by_claim["caps-take-more"][1])


def test_the_report_shows_printed_beside_measured_and_opens_the_source(
    openabf_run, tmp_path, quick_drawing
):
    report = write_report(openabf_run, tmp_path, "c", paper=small_openabf())
    tables = {table.name: table for table in items_of(report, Table)}
    first = tables["table-46"]
    rows = {row[0].text: [value.text for value in row] for row in first.rows}
    assert rows["wavy~49928f"][2:] == ["0.45", "2.00 ±0%", "0.27", "1.00 ±0%"]
    assert rows["sphere~50880f"][2] == ""
    assert "table-123" not in tables
    address = "https://github.com/educelab/OpenABF/pull/46"
    assert any(address in note for note in first.notes)
    assert f'<a href="{address}">{address}</a>' in (tmp_path / "index.html").read_text()


# Programs of the methods' authors


@pytest.fixture(scope="module")
def disks(tmp_path_factory):
    by = {"fdm-program": "fdm", "bff-program": "bff-free", "bff-program-disk": "bff"}
    seconds = {"fdm": 3.0, "ldm": 1.0, "fdm-program": 9.0, "bff": 1.0, "bff-free": 1.0}
    seconds |= {"bff-program-disk": 2.0, "lscm": 2.0, "abf++": 4.0, "cetm": 30.0, "cetm-flips": 8.0}
    phases = {"bff": {"factorisation": 0.5, "solves": 0.3, "boundary sweeps": 0.2}}
    meshes = [hemi_ellipsoid(300), flat_disk(200, stretch=2.0)]
    folder = tmp_path_factory.mktemp("disks") / "run"
    return write(folder, meshes, seconds, by=by, phases=phases)


def test_a_paper_without_printed_tables_has_claims_alone(disks, tmp_path, quick_drawing):
    paper = find_paper("ldm2018")
    assert (paper.models, paper.printed) == ((), {})
    report = write_report(disks, tmp_path, "c", paper=paper)
    assert report.paper == paper
    titles = [section.title for section in sections_of(report)]
    assert "Claims of the paper" in titles
    assert not any(title.startswith("Table") for title in titles)
    by_claim = verdicts(disks, "ldm2018")
    assert by_claim["time-saved"] == (
        "holds",
        "2 of 2 surfaces; saved flat-disk: 67 % (67 to 67); hemi-ellipsoid: 67 % (67 to 67), "
        "median 67 %",
    )  # fmt: skip
    assert by_claim["comparable-accuracy"][0] == "holds"


def test_amortised_cost_leaves_out_the_factorisation(disks):
    by_claim = verdicts(disks, "bff2017")
    assert by_claim["fifty-times"] == (
        "holds", "CETM over amortised BFF: 60 (surface 1), 60 (surface 2)",
    )  # fmt: skip
    assert by_claim["faster-than-linear"][0] == "holds"
    assert by_claim["program-agrees"][0] == "holds"
    assert by_claim["single-factorisation"][0] == "not tested here"


def test_flips_are_compared_with_cetm_where_that_fails(disks):
    by_claim = verdicts(disks, "ceps2021")
    assert by_claim["any-mesh"][0] == "holds"
    assert by_claim["exactly-conformal"][0] == "holds"
    assert by_claim["where-cetm-fails"] == (
        "not tested here",
        "CETM has 2 of 2 surfaces, cetm-flips 2; 0 of the 0 that CETM lacks",
    )


def test_the_overlay_is_judged_on_the_refinement():
    mesh = hemi_ellipsoid(600)
    result = cetm_flips_overlay(mesh)
    told = result.extras
    assert (told["overlay_valid"], flipped_triangles(mesh, result.uv)) == (1.0, 0)
    assert told["overlay_triangles"] > mesh.m
    assert told["flips"] > 0
    assert told["curvature"] < 1e-9
    own = load_registry().algorithm("cetm-flips").function(mesh)
    assert told["curvature"] == own.extras["curvature"]
    assert np.allclose(result.uv, own.uv, atol=1e-12)


def test_the_table_of_success_counts_maps_folds_and_angle_sums(disks, tmp_path, quick_drawing):
    report = write_report(disks, tmp_path, "c", paper=find_paper("ceps2021"))
    found = {table.name: table for table in items_of(report, Table)}["declared-1-success-of-disks"]
    rows = {row[0].text: [value.text for value in row] for row in found.rows}
    headings = [f"{c.group} {c.title}".strip() for c in found.columns]
    flips = dict(zip(headings, rows["CETM (flips)"], strict=True))
    assert (flips["disks"], flips["valid"], flips["share"]) == ("2", "2", "100.0")
    assert float(flips["error of angle sums largest"]) < 1e-8
    assert flips["seconds median"] == "8"
    assert flips["on the refinement valid"] == "-"


@pytest.mark.parametrize("name", ["fdm-program", "ldm-program", "poly-annulus-program"])
def test_a_program_that_its_variable_names_is_declared_with_its_own_remedy(
    name, tmp_path, monkeypatch
):
    file = tmp_path / "its_map.m"
    file.write_text("function uv = its_map(v, f)\nuv = v(:, 1:2);\n")
    monkeypatch.setenv(f"CEMBENCH_{name.upper().replace('-', '_')}", str(file))

    @choi_lui.matlab_program(name, "f", "https://example.org", title=name, target="disk")
    def declared(mesh: DiskMesh) -> None:
        """Map a disk."""

    program = vars(declared)["__cembench__"].program
    assert any("its_map(double(mesh.v)" in word for word in program.command)
    assert program.remedy.startswith("Get it from https://example.org")


def of_models(name, models):
    """Return the paper with small surfaces as its models."""
    tables = {0: {f"model {k}": {"faces": faces} for k, (_, faces) in enumerate(models)}}
    surfaces = {f"model {k}": surface for k, (surface, _) in enumerate(models)}
    update = {"tables": tables, "surfaces": surfaces}
    return find_paper(name).model_copy(update=update)


def test_our_reading_of_fdm_is_compared_with_the_program(disks):
    mesh = hemi_ellipsoid(300)
    paper = of_models("fdm2015", [(mesh.name, mesh.m)])
    evidence = Evidence.of(disks, paper)
    assert [(s.paper_row, s.origin) for s in evidence.models] == [("model 0", "model")]
    by_key = {claim.name: claim for claim in claims(evidence, {})}
    assert by_key["program-bijective"].verdict == "holds"
    # These cells are not of `public_program`, so the program stands alone.
    assert by_key["our-reading"].verdict == "not tested here"
    checks = paper.functions()
    assert checks["apart"](evidence.frame["seconds"].dropna().iloc[:2]) >= 0


def test_the_program_for_holes_is_compared_with_ours(tmp_path):
    mesh = holed_disk(400)
    by = {"poly-annulus-program": "koebe-cem"}
    seconds = {"poly-annulus-program": 9.0, "koebe-cem": 1.0, "direct-cem-holes": 1.0}
    run = write(tmp_path / "run", [mesh], seconds, by=by)
    evidence = Evidence.of(run, of_models("polyannulus2021", [(mesh.name, mesh.m)]))
    by_key = {claim.name: claim for claim in claims(evidence, {})}
    assert by_key["bijective"].verdict == "holds"
    assert by_key["koebe-cem-closer"].verdict == "does not hold here"  # the same map
    assert " beside " in by_key["direct-cem-closer"].figures


def test_no_paper_has_no_models():
    assert NO_PAPER.model_of("flat-disk", 200) == ""

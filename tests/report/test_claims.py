import numpy as np
import pytest
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.report.content.claims import CLAIMS, claims, efficiency, iteration
from cembench.report.content.claims.premises import spectrum_of_iteration
from cembench.report.content.claims.verdicts import verdict_of
from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import Inspection, _angles
from tests.report.small_run import write_run


@pytest.fixture(scope="module")
def inspections(evidence):
    found = {}
    for surface in evidence.surfaces:
        mesh, series = evidence.mesh(surface), evidence.series_of("cem")
        record = evidence.find(surface, series)
        angles = {series.label: _angles(mesh, evidence.uv(record), record)}
        found[surface.mesh_hash] = Inspection(surface, kept=True, angles=angles)
    return found


@pytest.fixture(scope="module")
def found(evidence, inspections):
    return {claim.name: claim for claim in claims(evidence, inspections)}


def test_a_verdict_follows_from_how_often_a_claim_held():
    verdicts = [verdict_of(*counts) for counts in ((3, 3), (2, 3), (0, 3), (0, 0))]
    assert verdicts == ["holds", "holds in part", "does not hold here", "not tested here"]


def test_every_claim_has_a_verdict_of_its_own_figures(found):
    assert len(found) == len(CLAIMS) >= 10
    # QIEM once and FDM twice slower, LDM faster once and equal once, under one policy.
    always = found["always-faster"]
    assert always.verdict == "holds in part"
    assert "LDM (reuse): 0 of 2, lowest rate -0.50" in always.figures
    assert "FDM (reuse): 2 of 2" in always.figures
    assert found["less-than-one-second"].verdict == "not tested here"
    assert found["inversion"].verdict == "not tested here"
    assert found["no-folding"].verdict == "holds"
    assert found["circular-holes"].verdict == "not tested here"


def test_where_cem_is_always_faster_the_claim_holds(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    for record in store.records():
        if record.cell.algorithm == "ldm":
            (tmp_path / "run" / "records" / f"{record.cell.label}.json").unlink()
    claim = efficiency.always_faster(Evidence.of(store.folder), {})
    assert claim.verdict == "holds"
    assert "None is a model of the paper itself" in claim.remark
    assert "this project's implementations" in claim.remark


@pytest.mark.parametrize(
    ("history", "becomes"),
    [
        ((3.0, 2.0, 1.0), True),
        ((1.0, 3.0, 2.0), True),  # a rise at first
        ((3.0, 1.0, 2.0), False),  # a rise at last
        ((3.0, 1.0, 2.0, 1.5), False),
        ((1.0, 2.0), False),
    ],
)
def test_becoming_monotonically_decreasing_allows_a_rise_at_first_alone(history, becomes):
    assert iteration.becomes_decreasing(history) is becomes


def test_the_printed_tables_agree_but_for_the_misprint(evidence):
    claim = efficiency.table_2_follows(evidence, {})
    assert claim.verdict == "holds in part"
    assert claim.figures.startswith("57 of 58 cells agree; not: Knit Cap Man / FDM: 29.07")


def test_the_four_faces_are_judged_from_the_stored_maps(found, inspections, evidence):
    claim = found["below-one-degree"]
    (surface,) = (s for s in evidence.models if s.paper_row == "Liu's Neutral Face")
    share = inspections[surface.mesh_hash].angles["CEM"].below_one
    assert claim.figures.startswith(f"Liu's Neutral Face: {share:.1%}")
    assert all(seen.angles["CEM"].agrees for seen in inspections.values())


def test_a_rise_of_the_energy_is_counted_but_not_rounding():
    assert iteration.rises([3.0, 2.0, 2.0 + 1e-15, 1.0]) == 0
    assert iteration.rises([3.0, 2.0, 2.1, 1.0]) == 1


def test_the_iteration_matrix_of_a_delaunay_cap_is_as_the_theorem_says():
    smallest, first, second = spectrum_of_iteration(spherical_cap(300))
    assert smallest > 0
    assert first == pytest.approx(1, abs=1e-10)
    assert second < 1 - 1e-3
    assert np.isfinite(second)

from dataclasses import replace

import numpy as np
import pytest
from cembench.papers.cem import checks
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.conformal.metrics import all_metrics, dilatations
from cembench.core.errors import ParameterError
from cembench.registry import load_registry
from cembench.report.content.claims import at_a_glance, claims, counted, in_short, verdict_of
from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import Inspection, _angles
from cembench.results.records import Round
from tests import gallery
from tests.records import changed, record_of
from tests.report.small_run import write_run


@pytest.fixture(scope="module")
def inspections(evidence):
    by_name = {}
    for surface in evidence.surfaces:
        mesh, series = evidence.mesh(surface), evidence.series_of("cem")
        record = evidence.find(surface, series)
        angles = {series.label: _angles(mesh, evidence.uv(record), record)}
        by_name[surface.mesh_hash] = Inspection(surface, kept=True, angles=angles)
    return by_name


@pytest.fixture(scope="module")
def found(evidence, inspections):
    return {claim.name: claim for claim in claims(evidence, inspections)}


def claim_of(evidence, name):
    """One claim of the paper on a run."""
    one = next(claim for claim in evidence.paper.claims if claim.name == name)
    paper = evidence.paper.model_copy(update={"claims": (one,)})
    (claim,) = claims(replace(evidence, asked=paper), {})
    return claim


def test_a_verdict_follows_from_how_often_a_claim_held():
    verdicts = [verdict_of(*counts) for counts in ((3, 3), (2, 3), (0, 3), (0, 0))]
    assert verdicts == ["holds", "holds in part", "does not hold here", "not tested here"]
    assert verdict_of(0, 0, lacking=1) == "too few rounds"


def test_every_claim_has_a_verdict_of_its_own_figures(found, evidence):
    assert list(found) == [claim.name for claim in evidence.paper.claims]
    assert len(found) == 25
    # QIEM once and FDM twice slower, LDM faster once and equal once, under one policy.
    always = found["always-faster"]
    assert always.verdict == "holds in part"
    assert "LDM (reuse): 0 of 2, lowest rate -0.50" in always.figures
    assert "FDM (reuse): 2 of 2" in always.figures
    assert found["less-than-one-second"].verdict == "not tested here"
    assert found["inversion"].verdict == "not tested here"
    assert found["no-folding"].verdict == "holds"
    assert found["circular-holes"].verdict == "not tested here"


def test_the_claims_at_a_glance_are_in_plain_words_failing_ones_first(found, evidence):
    table = at_a_glance(list(found.values()))
    by_words = {row[0].text: row for row in table.rows}
    assert set(by_words) == {claim.plain for claim in evidence.paper.claims}
    assert all(claim.plain for claim in evidence.paper.claims)
    faster = by_words["CEM is faster than QIEM, FDM and LDM on every model."]
    titles = [column.title for column in table.columns]
    assert titles[1:-1] == ["on stand-ins", "on other surfaces", "by the printed tables"]
    assert faster[1].text == "holds in part, 6 of 10"
    assert faster[3].text == "holds, 58 of 58"
    assert [entry.text for entry in by_words["Holes become circles."][1:-1]] == ["-", "-", "-"]
    verdicts = [row[1].text.partition(",")[0] for row in table.rows]
    assert verdicts.index("holds in part") < verdicts.index("holds")


def test_the_printed_tables_are_a_control_that_refutes_three_claims(found):
    """The counts are of Tables 2 to 4 alone, of the models that have all three algorithms."""
    control = {name: claim.parts.get("printed") for name, claim in found.items()}
    assert control["energy-similar"].counted.startswith("12 of 18 ")
    assert control["deviation-similar"].counted.startswith("17 of 18 ")
    assert control["means-slightly-better"].counted.startswith("8 of 18 ")
    assert control["more-than-80-percent"].counted.startswith("2 of 3")


def test_a_claim_is_judged_on_models_and_on_stand_ins_apart(evidence):
    """One record's surface is the model itself; stand-ins have no say on its verdict."""
    one = "Chinese Vase"
    records = tuple(
        changed(r, mesh={"origin": "model", "non_delaunay_share": 0.1})
        if r.mesh.paper_row == one
        else r
        for r in evidence.records
    )
    claim = claim_of(replace(evidence, records=records), "delaunay")
    assert list(claim.parts) == ["model", "stand-in", "surface"]
    assert claim.verdict == claim.parts["model"].verdict == "does not hold here"
    assert claim.parts["stand-in"].verdict == "holds"
    assert claim.figures.startswith("On 1 of the paper's models: does not hold here, 0 of 1 (")
    assert "On 1 stand-in for a model: holds, 1 of 1 (" in claim.figures


def test_a_stand_in_has_no_vote_beside_its_model(evidence):
    twin = [
        changed(r, cell={"mesh_hash": "f" * 64}, mesh={"origin": "model"})
        for r in evidence.records
        if r.mesh.paper_row == "Chinese Vase"
    ]
    claim = claim_of(replace(evidence, records=(*evidence.records, *twin)), "delaunay")
    assert [claim.parts[one].counted for one in ("model", "stand-in")] == ["1 of 1", "1 of 1"]


def test_figures_that_a_stand_in_was_fitted_to_decide_nothing(evidence):
    fitted = tuple(
        changed(r, mesh={"fitted": "fdm"}) if r.mesh.paper_row else r for r in evidence.records
    )
    for name in ("energy-similar", "deviation-similar", "means-slightly-better"):
        assert "stand-in" in claim_of(evidence, name).parts
        claim = claim_of(replace(evidence, records=fitted), name)
        assert list(claim.parts) == ["printed"]
        assert claim.verdict == "not tested here"
    assert claim_of(replace(evidence, records=fitted), "always-faster").parts["stand-in"].counted


def test_the_claims_in_short_say_what_holds_on_the_models_first(evidence, found):
    models = tuple(
        changed(r, mesh={"origin": "model"}) if r.mesh.paper_row else r for r in evidence.records
    )
    table = in_short(claims(replace(evidence, records=models), {}))
    heads = [row[0].text.split(" ", 1)[1] for row in table.rows]
    assert heads[0] == "hold on the paper's models"
    assert "are not borne out by the paper's own tables" in heads
    assert heads[-1] == "could not be tested"
    numbers = {row[0].text.split(" ", 1)[1]: int(row[0].text.split()[0]) for row in table.rows}
    assert numbers["are not borne out by the paper's own tables"] == 5


def test_the_share_of_a_claim_has_an_interval_over_families():
    def case(family, holds, of=1):
        return {"family": family, "holds": holds, "of": of}

    faces = [case("face", True)] * 100
    assert counted(faces) == "100 of 100"  # one family shows nothing about others
    others = [case(f"statue-{k}", k > 0) for k in range(9)]
    # Nine of ten families, Wilson: 0.596 to 0.982.
    assert counted([*faces, *others]) == "108 of 109 (60 to 98 % of families)"
    assert counted([case(None, 3, 20), case(None, 20, 20), case(None, 0, 0)]) == "23 of 40"


def test_folds_before_the_repair_count_in_the_claim_on_folding(evidence, found):
    clean = "Before the repair, 0 triangles are folded on 0 of 2 surfaces; in the maps that are "
    assert found["no-folding"].parts["stand-in"].figures.startswith(clean)
    vase = next(s for s in evidence.surfaces if s.paper_row == "Chinese Vase")

    def with_folds(record):
        is_it = record.cell.mesh_hash == vase.mesh_hash and record.cell.algorithm == "cem"
        extras = {"folded_before_repair": 119, "fold_repairs": 1} if is_it else {}
        return changed(record, outcome={"extras": record.outcome.extras | extras})

    records = tuple(map(with_folds, evidence.records))
    claim = claim_of(replace(evidence, records=records), "no-folding")
    told = f"119 triangles are folded on 1 of 2 surfaces ({vase.title}ˢ: 119)"
    assert claim.parts["stand-in"].figures == (
        f"Before the repair, {told}; in the maps that are compared, 0 triangles are folded on 0 of "
        "2 surfaces."
    )
    assert claim.verdict == "holds in part"


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"holds": "sekonds < 1"}, "claim 'delaunay': 'sekonds < 1' names 'sekonds'; known are"),
        ({"figures": "{held.real}"}, "claim 'delaunay': .*asks for 'real'; allowed are"),
        ({"figures": "{held"}, r"claim 'delaunay': .* is no expression: f-string: expecting '}'"),
    ],
)
def test_an_expression_that_fails_is_said_with_its_claim_and_file(evidence, changed, told):
    one = next(claim for claim in evidence.paper.claims if claim.name == "delaunay")
    paper = evidence.paper.model_copy(update={"claims": (one.model_copy(update=changed),)})
    with pytest.raises(ParameterError, match=f"papers/cem/claims.toml: {told}"):
        claims(replace(evidence, asked=paper), {})


def test_where_cem_is_always_faster_the_claim_holds(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    for record in store.records():
        if record.cell.algorithm == "ldm":
            (tmp_path / "run" / "records" / f"{record.cell.label}.json").unlink()
    evidence = Evidence.of(store.folder)
    claim = claim_of(evidence, "always-faster")
    assert claim.verdict == "holds"
    assert "None is a model of the paper itself" in claim.remark
    assert "this project's implementations" in claim.remark


def with_seconds(evidence, seconds_of):
    """The run's cells under "reuse" with other rounds; `seconds_of` takes a record."""
    records = []
    for record in evidence.records:
        if record.outcome.rounds and record.cell.solves == "reuse":
            rounds = tuple(Round(sitting="s", calls=(t,)) for t in seconds_of(record))
            records.append(changed(record, outcome={"rounds": rounds}))
    return replace(evidence, records=tuple(records))


#: Seconds of a round with which CEM is faster than all others.
FASTER = {"cem": 1.0, "qiem": 8.0, "fdm": 18.0, "ldm": 5.0}


def test_a_claim_on_speed_is_decided_on_the_surfaces_that_have_the_rounds(evidence):
    """One round on one of two models, as where a budget ends, is counted and decides nothing."""
    few = {"Chinese Vase": 1}

    def seconds_of(record):
        of = FASTER.get(record.cell.algorithm, 1.0)
        return [of] * few.get(record.mesh.paper_row, 6)

    claim = claim_of(with_seconds(evidence, seconds_of), "always-faster")
    assert claim.verdict == "holds"
    assert "FDM: 1 of 1, lowest rate 17.00; too few" in claim.figures
    assert "p = " not in claim.figures  # the table of certainty has the one test
    assert claim.figures.count("; too few rounds on 1 more") == 2  # QIEM failed there
    average = claim_of(with_seconds(evidence, seconds_of), "average-rates")
    assert average.verdict == "holds"  # 7 for QIEM, where 6.6 is printed for that model
    assert (
        "FDM: mean 17.0, printed for these 15.3, geometric 17.0 (n = 1; too few rounds on 1 more)"
        in average.figures
    )
    few["Liu's Neutral Face"] = 5
    none = claim_of(with_seconds(evidence, seconds_of), "always-faster")
    assert none.verdict == "too few rounds"
    assert "FDM: 0 of 0; too few rounds on 2" in none.figures


def test_a_surface_on_which_the_interval_holds_equal_times_does_not_support_the_claim(evidence):
    def seconds_of(record):
        of = FASTER.get(record.cell.algorithm, 1.0)
        shaky = record.cell.algorithm == "ldm" and record.mesh.paper_row == "Chinese Vase"
        return [1.1, 1.2, 0.5, 1.3, 0.6, 1.4, 1.2] if shaky else [of] * 7

    claim = claim_of(with_seconds(evidence, seconds_of), "always-faster")
    assert claim.verdict == "holds in part"
    assert "LDM: 1 of 2, lowest rate 0.20" in claim.figures
    assert "too few rounds" not in claim.figures


def test_seconds_on_large_surfaces_need_rounds_too(evidence):
    def large(rounds):
        def seconds_of(record):
            return [0.5] * rounds[record.mesh.paper_row]

        few = with_seconds(evidence, seconds_of)
        grown = [changed(r, mesh={"faces": 200_000}) for r in few.records]
        return claim_of(replace(few, records=tuple(grown)), "less-than-one-second")

    some = large({"Chinese Vase": 1, "Liu's Neutral Face": 6, "": 1})
    assert some.verdict == "holds"
    assert some.parts["stand-in"].figures.endswith("200,000: 0.500 s; too few rounds on 1 more.")
    assert some.parts["surface"].verdict == "too few rounds"
    none = large({"Chinese Vase": 1, "Liu's Neutral Face": 1, "": 1})
    assert none.verdict == "too few rounds"


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
    assert checks.becomes_decreasing(history) is becomes


def test_the_printed_tables_agree_but_for_the_misprint(evidence):
    claim = claim_of(evidence, "table-2-follows")
    assert claim.verdict == "holds in part"
    assert claim.figures.startswith("57 of 58 cells agree; not: Knit Cap Man / FDM: 29.07")


def test_the_four_faces_are_judged_from_the_stored_maps(found, inspections, evidence):
    claim = found["below-one-degree"]
    (surface,) = (s for s in evidence.models if s.paper_row == "Liu's Neutral Face")
    share = inspections[surface.mesh_hash].angles["CEM"].below_one
    assert claim.figures.startswith(f"Liu's Neutral Faceˢ: {100 * share:.1f} %; of all 2, ")
    assert all(seen.angles["CEM"].agrees for seen in inspections.values())


def test_a_rise_of_the_energy_is_counted_but_not_rounding():
    assert checks.rises([3.0, 2.0, 2.0 + 1e-15, 1.0]) == 0
    assert checks.rises([3.0, 2.0, 2.1, 1.0]) == 1


def test_the_iteration_matrix_of_a_delaunay_cap_is_as_the_theorem_says():
    smallest, first, second = checks.spectrum(checks.iteration_matrix(spherical_cap(300)))
    assert smallest > 0
    assert first == pytest.approx(1, abs=1e-10)
    assert second < 1 - 1e-3
    assert np.isfinite(second)


def test_the_claims_on_the_start_hold_and_say_with_what_figures(found):
    for name in ("any-index", "schur-start", "convex-hull"):
        assert found[name].verdict == "holds", found[name].figures
    counted = "(18) takes 1 factorisation and 2 real columns solved, (21) 1 and 3"
    assert counted in found["schur-start"].figures
    assert "near p" in found["distortion-near-p"].figures
    assert found["distortion-near-p"].verdict == "does not hold here"
    assert found["other-weights"].verdict == "holds"


@pytest.mark.parametrize("k", [0, 5, -1])
def test_the_schur_complement_and_any_pin_give_the_least_squares_solution(k):
    """Against the dense pseudo-inverse of the singular L (Eq. 13)."""
    mesh = spherical_cap(300)
    L, rhs, corners = checks.start_system(mesh)
    exact = np.linalg.pinv(L.toarray(), hermitian=True) @ rhs
    f = checks.pinned(checks.Solved(), L, rhs, k % mesh.n)
    g = checks.condensed(checks.Solved(), L, rhs, corners, k % mesh.n)
    assert (f[k], g[k]) == (0, 0)
    assert checks.apart(exact, f) < 1e-10
    assert checks.apart(exact, g) < 1e-10
    assert checks.apart(exact, exact + 0.1 * exact.real) > 0.01  # a difference is seen


def test_on_a_flat_disk_the_map_with_a_pole_has_mu_z_squared():
    """1 / z + conj(z) solves Eq. 11 there: conformal at the pole, a fold at the boundary."""
    off, near, rim = [], [], []
    for mesh in map(flat_disk, (600, 2400, 9600)):
        L, rhs, _ = checks.start_system(mesh)
        f = checks.pinned(checks.Solved(), L, rhs, 0)
        z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
        K = dilatations(mesh, f)
        middle = np.abs(z[mesh.F].mean(axis=1))
        between = (middle > 0.4) & (middle < 0.9)
        off.append(np.abs((K - 1) / (K + 1) - middle**2)[between].mean())
        figures = checks.distortion_near_pole_and_boundary(mesh, 0.01, 10)
        near, rim = [*near, figures[0]], [*rim, figures[1]]
    np.testing.assert_allclose(np.log2(np.array(off[:-1]) / off[1:]), 1, atol=0.15)
    assert near[0] > 1.3 * near[1] > 1.3**2 * near[2]  # what is left there is the mesh's
    assert 60 < rim[0] < rim[1] < rim[2]


def test_points_leave_their_convex_hull_where_a_weight_is_negative():
    mesh = spherical_cap(300)
    K = checks.iteration_matrix(mesh)
    assert checks.largest_escape(K) <= 0
    K[0, :2] += [-0.5, 0.5]
    assert K.min() < 0
    np.testing.assert_allclose(K.sum(axis=1), 1)
    assert checks.largest_escape(K - 2 * (K - np.eye(len(K)))) > 0.01


def test_the_row_on_circular_holes_is_judged_by_the_records(evidence):
    """Holes that are circles, and the same with one of them pulled out."""
    mesh = gallery.three_holes()
    uv = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    hole = next(loop for loop in mesh.loops if 0 < np.abs(uv[loop]).max() < 0.99)
    pulled = uv.copy()
    pulled[hole] = uv[hole].mean() + 1.2 * (uv[hole] - uv[hole].mean()).real
    pulled[hole] += 1j * (uv[hole] - uv[hole].mean()).imag
    koebe = load_registry().algorithm("koebe-cem")
    printed = {"patches": "fans", "weights": "plane"}
    about = {"title": koebe.title, "target": koebe.target, "mesh": evidence.records[0].mesh}
    records = []
    for code, z in (("c", uv), ("d", pulled)):
        metrics = all_metrics(mesh, z)
        off = {"circularity_before_rounding": metrics["boundary_circularity"]}
        cell = {"code_hash": code, "mesh": "holes", "mesh_hash": mesh.hash, "parameters": printed}
        records.append(
            changed(
                record_of(algorithm="koebe-cem", **cell),
                outcome={"status": "ok", "metrics": metrics, "extras": off},
                **about,
            )
        )
    for chosen, verdict in (
        (records[:1], "holds"),
        (records[1:], "does not hold here"),
        (records, "holds in part"),
    ):
        claim = claim_of(replace(evidence, records=tuple(chosen)), "circular-holes")
        assert claim.verdict == verdict
        assert "as printed: holes: up to " in claim.figures
    own = {"parameters": {"patches": "disks", "weights": "surface"}}
    other = [changed(r, cell=own) for r in records]
    claim = claim_of(replace(evidence, records=tuple(other)), "circular-holes")
    assert claim.verdict == "not tested here"
    assert "as printed: not in this run" in claim.figures

"""What the head of a report says of a run."""

import re
from dataclasses import replace

import pytest

from cembench.report.content.claims import claims
from cembench.report.content.evidence import Evidence
from cembench.report.content.findings import findings, verdicts_counted
from cembench.report.content.paper_head import head_table, headline
from cembench.report.content.report import is_of_the_paper
from cembench.report.content.standings import as_good
from cembench.report.declared_plots import declared_plot
from cembench.report.document import VERDICTS, Claim, plain
from cembench.results.papers import find_paper
from tests.records import changed
from tests.report.small_run import write_run


@pytest.mark.parametrize(
    ("angles", "best", "good"),
    [
        ([1.2], [1.0], True),
        ([1.3], [1.0], False),
        ([0.2], [0.01], True),  # ten times, but of next to nothing
        ([1.0, 2.0], [1.0, 1.0], False),
        ([], [], True),
    ],
)
def test_maps_are_as_good_by_share_or_by_degrees(angles, best, good):
    assert as_good(angles, best) is good


def without(evidence, dropped):
    kept = tuple(record for record in evidence.records if not dropped(record))
    return Evidence(evidence.store, kept, evidence.exhibits)


def words_of(found):
    return [plain(sentence) for sentence in found.sentences]


def test_the_fastest_is_named_and_its_interval_stands_in_the_table(evidence):
    on_one = without(evidence, lambda r: r.mesh.paper_row != "Liu's Neutral Face")
    head = findings(on_one, {}, [])
    assert words_of(head)[0].startswith("On one surface, ")
    times, angles, ended = head.figures
    # Invented seconds are equal in all rounds: the interval is the figure itself.
    (told,) = {
        row[-1].text for row in head.tables[0].rows if row[-1].text.startswith(times.number[:4])
    }
    ratio, low, high = map(float, re.findall(r"[\d.]+", told))
    assert times.number == f"{ratio:.2f} times"
    assert low == high == ratio > 1
    assert "interval" not in " ".join(words_of(head)[:1])
    assert angles.number.endswith("°")
    assert ended.number == f"{len(on_one.records)} of {len(on_one.records)}"


def test_of_few_rounds_no_winner_is_named(evidence):
    def first_round(record):
        return changed(record, outcome={"rounds": record.outcome.rounds[:1]})

    on_one = without(evidence, lambda r: r.mesh.paper_row != "Liu's Neutral Face")
    few = replace(on_one, records=tuple(map(first_round, on_one.records)))
    head = findings(few, {}, [])
    assert any("hese rounds do not show which of" in words for words in words_of(head))
    assert not any("the speed of" in figure.words for figure in head.figures)
    timed = ("always-faster", "average-rates", "average-savings", "more-than-80-percent")
    known = [one for one in few.paper.claims if one.name in (*timed, "table-2-follows")]
    asked = few.paper.model_copy(update={"claims": tuple(known)})
    tested = claims(replace(few, asked=asked), {})
    verdicts = {claim.name: claim.verdict for claim in tested}
    assert verdicts.pop("table-2-follows") == "holds in part"  # of the printed tables alone
    assert verdicts == dict.fromkeys(timed, "too few rounds")
    assert "4 have too few rounds" in words_of(findings(few, {}, tested))[1]


def test_a_run_in_which_nothing_ended_ok_names_nobody(evidence):
    failed = without(evidence, lambda r: r.outcome.status == "ok")
    head = findings(failed, {}, [])
    assert words_of(head) == ["No map to compare."]
    assert head.tables[:-1] == ()
    assert [figure.number for figure in head.figures] == [f"0 of {len(failed.records)}"]


def claim_with(verdict, name):
    return Claim(name, "sentence", "place", "test", "figures", verdict)


def test_all_verdicts_are_counted_failing_ones_first_and_linked():
    verdicts = ["holds", "too few rounds", "holds in part", "holds", "not tested here"]
    claims = [claim_with(v, f"a-{k}") for k, v in enumerate([*verdicts, "does not hold here"])]
    counted = verdicts_counted(claims)
    assert plain(counted) == (
        "Of 6 claims of the paper, 1 does not hold here: a 5; 1 holds in part; 2 hold; "
        "1 has too few rounds; 1 is not tested here."
    )
    assert [part for part in counted if isinstance(part, Claim)] == [claims[5]]
    every = [claim_with(v, f"{v}-{k}") for v in VERDICTS for k in range(3)]
    numbers = re.findall(r"(\d+) (?:do|hold|have|are)", plain(verdicts_counted(every)))
    assert sum(map(int, numbers)) == len(every)


def rates_of(table):
    """The cells of the average rates: printed, and by origin of surfaces."""
    rows = [row for row in table.rows if row[0].text.startswith("average speedup")]
    return [[value.text for value in row[1:]] for row in rows]


def test_the_papers_main_claims_stand_beside_what_was_measured(evidence):
    table = head_table(evidence, [])
    # Invented: QIEM takes 8 s on one model, FDM 3 and 6, LDM 0.5 and 1; CEM 1, as `backslash` 2.
    assert [column.title for column in table.columns] == ["claim", "printed", "on 2 stand-ins"]
    printed, here = zip(*rates_of(table), strict=True)
    assert printed == ("8.5", "17.2", "4.1") * 2
    assert all(cell.startswith("too few for an interval: ") for cell in here)
    rates, of_these = zip(*(map(float, re.findall(r"-?\d+\.\d", c)) for c in here), strict=True)
    assert rates == pytest.approx([7, 3.5, -0.25, 3, 1.25, -0.625], abs=0.06)
    assert of_these[1::3] == (13.9, 13.9)
    assert [row[0].text.rpartition(" ")[2] for row in table.rows[::3]] == ["(reuse)", "(backslash)"]
    assert len(table.rows) == 6


def test_the_papers_main_claims_have_intervals_over_enough_models(evidence):
    def on(record, k, model):
        slow = k if record.cell.algorithm == "fdm" else 1
        return changed(
            record,
            {"calls": [(slow * r.seconds,) for r in record.outcome.rounds]},
            cell={"mesh": model, "mesh_hash": model},
            mesh={"paper_row": model, "origin": "model"},
        )

    vase = without(evidence, lambda r: r.mesh.paper_row != "Chinese Vase")
    records = [r for r in vase.records if r.cell.solves == "reuse" and r.outcome.status == "ok"]
    models = find_paper("cem").models[:6]
    six = tuple(on(r, 1 + k / 10, model) for k, model in enumerate(models) for r in records)
    run = replace(evidence, records=six)
    table = head_table(run, [])
    assert table.columns[2].title == "on 6 models of the paper"
    (_, qiem), (_, fdm), (_, _) = rates_of(table)
    assert qiem == "-"
    mean, low, high, of_these = map(float, re.findall(r"-?\d+\.\d", fdm))
    assert mean == pytest.approx(2.75, abs=0.06)
    assert low < mean < high < of_these
    assert fdm.startswith("less than printed")
    sentence = headline(run)
    assert "in 6 of the 12 comparisons that these rounds decide" in sentence
    assert "On 6 models of the paper, its average speedup is less than printed over " in sentence
    assert not re.search(r"\d\.\d", sentence)
    anew = tuple(changed(r, cell={"solves": "backslash"}) for r in six)
    first, _, last = headline(replace(run, records=six + anew)).partition("This is with reuse; ")
    assert first.rstrip() == sentence
    assert last == "with backslash, CEM is faster in 6 of 12."


def test_a_claim_is_judged_on_models_and_on_stand_ins_apart(evidence):
    models = [
        changed(r, cell={"mesh": "model", "mesh_hash": "m"}, mesh={"origin": "model"})
        for r in evidence.records
        if r.mesh.paper_row == "Chinese Vase"
    ]
    both = [r for r in evidence.records if r.mesh.paper_row != "Chinese Vase"]
    folded = {"metrics": {**models[0].outcome.metrics, "flipped_triangles": 3}, "status": "invalid"}
    wrong = [changed(r, outcome=folded) if r.cell.algorithm == "cem" else r for r in models]
    known = [one for one in evidence.paper.claims if one.name == "no-folding"]
    asked = evidence.paper.model_copy(update={"claims": tuple(known), "stated": {}})
    run = replace(evidence, records=(*both, *wrong), asked=asked, exhibits=())
    table = head_table(run, claims(run, {}))
    assert [c.title for c in table.columns[2:]] == ["on 1 model of the paper", "on 1 stand-in"]
    assert [value.text.partition(":")[0] for value in table.rows[0][2:]] == [
        "does not hold here",
        "holds",
    ]


def with_angles(evidence, **angles):
    """A run over surfaces of the user's own, with these mean angle errors; None: no valid map."""
    ended = [r for r in evidence.records if r.outcome.status == "ok" and r.cell.solves == "reuse"]
    known = {r.cell.algorithm: r for r in ended}
    records = []
    for name, errors in angles.items():
        base = known[name.replace("_", "-")]
        for k, error in enumerate(errors):
            metrics = base.outcome.metrics | {"angle_error_mean_deg": error}
            one = changed(
                base,
                cell={"mesh": f"mine-{k}", "mesh_hash": f"{k}"},
                mesh={"paper_row": "", "origin": "surface"},
                outcome={"status": "ok" if error else "failed", "metrics": metrics},
            )
            records.append(one)
    return replace(evidence, records=tuple(records), exhibits=())


#: CEM beside another: lower on one of nine surfaces, within 1 % on five, median ratio 1.009.
NEARLY = [0.94, 1.004, 1.006, 1.008, 1.009, 1.015, 1.02, 1.02, 1.03]


def test_smallest_is_said_only_of_an_interval_without_one(evidence):
    head = findings(with_angles(evidence, cem=NEARLY, fdm=[1.0] * 9), {}, [])
    assert words_of(head)[0].startswith(
        "On 9 surfaces, it is not decided which of FDM and CEM has the smallest angle errors; "
    )
    cem = head.tables[0].rows[1]
    assert [value.text for value in cem[4:6]] == ["11 % (2 to 43)", "56 % (27 to 81)"]
    worse = findings(
        with_angles(evidence, cem=[1.1 + k / 100 for k in range(9)], fdm=[1.0] * 9), {}, []
    )
    assert words_of(worse)[0].startswith(
        "On 9 surfaces, FDM has the smallest angle errors; those of CEM are 1.14 times as large."
    )
    ratio, low, high = map(float, re.findall(r"[\d.]+", worse.tables[0].rows[1][3].text))
    assert ratio == 1.14
    assert 1.1 < low < 1.14 < high < 1.18


def test_an_algorithm_with_one_wrecked_map_is_not_shown_to_be_worse(evidence):
    wrecked = {"fdm": [1.0] * 9, "cem": [1.14] * 9, "ldm": [1.0] * 8 + [30.0]}
    head = findings(with_angles(evidence, **wrecked), {}, [])
    assert words_of(head)[0].startswith(
        "On 9 surfaces, FDM has the smallest angle errors (not decided against LDM); those of CEM "
    )
    assert head.suspects == ("LDM on mine-8: 30 degrees, the other algorithms' median is 1.07",)


def test_few_surfaces_have_no_interval_and_nobody_is_the_best(evidence):
    head = words_of(findings(with_angles(evidence, cem=[1.1] * 5, fdm=[1.0] * 5), {}, []))[0]
    assert head.startswith("On 5 surfaces, FDM has the lowest angle errors on average; ")
    far = words_of(findings(with_angles(evidence, cem=[3.0] * 5, fdm=[1.0] * 5), {}, []))
    assert far[0].startswith("On 5 surfaces, FDM has the lowest angle errors on average; ")
    assert far[0].endswith("No other has angle errors about as small, so no fastest is named.")


def test_an_algorithm_without_most_maps_is_left_out_and_named(evidence):
    gaps = with_angles(evidence, cem=[1.0] * 8 + [None], fdm=[1.0] * 9, ldm=[1.0] * 9)
    head = words_of(findings(gaps, {}, []))[0]
    assert head.startswith("On 9 surfaces, it is not decided which of FDM and LDM ")
    assert "Left out, with too few maps: CEM." in head


def test_the_table_of_the_own_surfaces_has_a_row_each_and_gaps_with_a_cause(evidence):
    run = with_angles(evidence, cem=[1.5, None], lscm=[1.25, 2.0])
    table = findings(run, {}, []).tables[-1]
    heads = [(column.group, column.title) for column in table.columns[2:]]
    assert heads[:2] == [
        ("mean angle error, degrees", "CEM"),
        ("mean angle error, degrees", "LSCM *"),
    ]
    assert list(dict(heads)) == ["mean angle error, degrees", "E_C", "seconds", "folds"]
    assert [row[0].text for row in table.rows] == ["mine-0", "mine-1"]
    assert [value.number for value in table.rows[0][2:4]] == [1.5, 1.25]
    assert table.rows[1][2].text == "failed"
    assert any("not a map to the disk" in note for note in table.notes)


@pytest.mark.parametrize(
    ("models", "stand_ins", "others", "of_paper"),
    [
        (4, 0, 5, False),
        (8, 0, 1, False),
        (2, 0, 0, True),
        (0, 2, 1, True),
        (3, 17, 1, True),
        (1, 1, 2, False),
        (7, 20, 0, True),
    ],
)
def test_a_run_is_of_the_paper_or_of_the_users_own_surfaces(
    evidence, models, stand_ins, others, of_paper
):
    surfaces = with_angles(evidence, cem=[1.0] * (models + stand_ins + others)).records
    origins = ["model"] * models + ["stand-in"] * stand_ins + ["surface"] * others
    records = tuple(
        changed(record, mesh={"origin": o, "paper_row": "" if o == "surface" else "Foot"})
        for record, o in zip(surfaces, origins, strict=True)
    )
    assert is_of_the_paper(replace(evidence, records=records)) is of_paper


def test_variants_tried_on_fewer_surfaces_are_left_out_of_a_profile(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    ours = [r for r in store.records() if r.cell.algorithm == "cem"]
    (one,) = [r for r in ours if r.mesh.paper_row == "Chinese Vase"]
    evidence = Evidence.of(store.folder)
    other = changed(one, cell={"parameters": {"max_iterations": 3}})
    more = replace(evidence, records=(*evidence.records, other))
    assert len(more.disk_series) == len(evidence.disk_series) + 1
    panel = declared_plot(more, "performance-profile").panels[0]
    assert {series.name for series in panel.series} == {s.label for s in evidence.disk_series}


def test_the_head_says_how_many_times_are_unstable(evidence):
    timed = sum(bool(record.outcome.rounds) for record in evidence.records)
    times, ratios = words_of(findings(evidence, {}, []))[-2:]
    assert f" of {timed} times " in times
    assert " unstable (95 % interval wider than 25% of the figure)" in times
    assert ratios.startswith("Ratios of two algorithms scatter by ")


def test_surfaces_without_a_common_round_do_not_hide_who_is_the_fastest(evidence):
    both = with_angles(evidence, cem=[1.0] * 9, fdm=[1.0] * 9)
    apart = next(r for r in both.records if r.cell.algorithm == "fdm" and r.outcome.rounds)
    later = changed(apart, {"sitting": ["later"] * len(apart.outcome.rounds)})
    records = tuple(later if record is apart else record for record in both.records)
    for run in (both, replace(both, records=records)):
        assert "CEM is faster than FDM." in words_of(findings(run, {}, []))[0]


def test_maps_with_a_free_boundary_are_a_contest_of_their_own(evidence):
    run = with_angles(evidence, cem=[1.0] * 2, lscm=[0.5] * 2)
    other = [
        changed(r, cell={"algorithm": "mine"}, title="Mine", target="free boundary")
        for r in run.records
        if r.cell.algorithm == "lscm"
    ]
    quick = [changed(r, {"calls": [(0.5 * s.seconds,) for s in r.outcome.rounds]}) for r in other]
    head = findings(replace(run, records=(*run.records, *quick)), {}, [])
    assert words_of(head)[0] == (
        "With a free boundary, on 2 surfaces, LSCM has the lowest angle errors on average; those "
        "of Mine are within 1 % of them. At about equal angle errors, Mine is faster than LSCM."
    )
    assert not any("nothing to compare" in words for words in words_of(head))
    assert [figure.number for figure in head.figures[:2]] == ["2.00 times", "0.50°"]
    assert [[row[0].text for row in table.rows] for table in head.tables[:1]] == [["LSCM", "Mine"]]
    both = [changed(r, cell={"algorithm": "fdm"}, title="FDM") for r in run.records[:2]]
    more = findings(replace(run, records=(*run.records, *both, *quick)), {}, [])
    assert [table.name for table in more.tables[:2]] == ["standings", "standings-free-boundary"]


def test_of_one_algorithm_nothing_is_called_the_lowest(evidence):
    head = findings(with_angles(evidence, cem=[1.0] * 2), {}, [])
    assert "there is nothing to compare it with" in words_of(head)[0]
    assert not any("the lowest of 1" in figure.words for figure in head.figures)
    assert len(head.tables) == 1


def test_energies_are_by_the_image_s_area_where_its_size_is_free(evidence):
    run = with_angles(evidence, lscm=[1.0])
    (record,) = run.records
    metrics = record.outcome.metrics
    small = metrics | {
        "conformal_energy": metrics["conformal_energy"] / 16,
        "image_area": metrics["image_area"] / 16,
    }
    half = changed(record, cell={"algorithm": "mine"}, title="Mine", outcome={"metrics": small})
    table = findings(replace(run, records=(record, half)), {}, []).tables[-1]
    energies = [
        value.number
        for column, value in zip(table.columns, table.rows[0], strict=True)
        if column.group == "E_C"
    ]
    assert energies[0] == pytest.approx(energies[1])
    assert any("over the area of the image" in note for note in table.notes)


def test_no_time_is_stable_is_said_so(evidence):
    spread = tuple(
        changed(r, {"calls": [((1 + k),) for k in range(len(r.outcome.rounds))]})
        for r in evidence.records
        if r.outcome.rounds
    )
    words = words_of(findings(replace(evidence, records=spread), {}, []))
    assert any(one.startswith("No time is stable (") for one in words)

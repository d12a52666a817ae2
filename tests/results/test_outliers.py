"""Maps that are far worse than the others on their surface."""

import pytest

from cembench.api.benchmark import Run
from cembench.commands.benchmark import _print_run
from cembench.results.stability import NAMED, outlier_lines, outliers
from tests.records import changed, record_of


def map_of(algorithm, mesh, angle, *, target="disk", status="ok", **cell):
    record = record_of([1.0], algorithm=algorithm, mesh=mesh, mesh_hash=mesh, **cell)
    metrics = {} if angle is None else {"angle_error_mean_deg": angle}
    outcome = {"metrics": metrics, "status": status}
    return changed(record, title=algorithm.upper(), target=target, outcome=outcome)


#: The figures of a kept run: FDM wrecked on a stand-in, and counted as a valid map.
WRECKED = [
    map_of(name, "nefertiti", angle)
    for name, angle in (("cem", 8.14), ("fdm", 70.337), ("ldm", 8.17), ("qiem", 8.152))
]


def test_a_wrecked_map_is_named_with_both_figures():
    (found,) = outliers(WRECKED)
    assert found.record.cell.algorithm == "fdm"
    assert found.times == pytest.approx(70.337 / 8.152)
    assert outlier_lines(WRECKED) == [
        "FDM on nefertiti: 70.3 degrees, the other algorithms' median is 8.15"
    ]


@pytest.mark.parametrize(
    "changed",
    [
        {"angle": 3 * 8.152},  # not over three times
        {"target": "free boundary"},
        {"angle": None},
        {"mesh": "foot"},  # alone on its surface
    ],
)
def test_other_maps_are_not(changed):
    fdm = map_of(**{"algorithm": "fdm", "mesh": "nefertiti", "angle": 70.337} | changed)
    assert outliers([r for r in WRECKED if r.cell.algorithm != "fdm"] + [fdm]) == []


def test_the_status_does_not_matter_and_two_others_must_be_there():
    invalid = map_of("fdm", "foot", 9.0, status="invalid")
    one, two = (map_of(name, "foot", 1.0) for name in ("cem", "ldm"))
    assert [found.angle for found in outliers([invalid, one, two])] == [9.0]
    again = map_of("cem", "foot", 1.0, solves="backslash")
    assert outliers([invalid, one, again]) == []


def test_rounding_is_not_an_outlier():
    angles = {"cem": 1e-6, "ldm": 1e-14, "fdm": 1e-14}
    assert outliers([map_of(name, "flat", angle) for name, angle in angles.items()]) == []


def test_an_algorithm_has_a_line_with_its_worst_map_first_and_harmonic_ones_come_last():
    items = [
        map_of(name, f"m{k:02d}", angle)
        for k in range(10)
        for name, angle in (("cem", 1.0), ("ldm", 1.0), ("harmonic-circle", 4.0 + k), ("qiem", 1.0))
    ]
    first, second = outlier_lines([*items, map_of("fdm", "m03", 5.0)])
    assert first == "FDM on m03: 5 degrees, the other algorithms' median is 1"
    assert second.startswith("HARMONIC-CIRCLE on m09: 13 degrees, the other algorithms' median is ")
    assert f" and {9 - NAMED} more" in second
    assert second.endswith("(its maps are not conformal by design)")


def test_algorithms_beyond_five_are_counted():
    usual = [map_of(f"u{k}", "foot", 1.0) for k in range(9)]
    bad = [map_of(f"b{k}", "foot", 50.0 + k) for k in range(7)]
    lines = outlier_lines([*usual, *bad])
    assert len(lines) == 6
    assert lines[0].startswith("B6 on foot: 56 degrees")
    assert lines[-1] == "and 2 more maps by other algorithms"


def test_the_summary_after_a_run_names_them(tmp_path, capsys):
    _print_run(Run(tmp_path, tuple(WRECKED)), None, as_json=False)
    printed = " ".join(capsys.readouterr().out.split())
    assert "! FDM on nefertiti: 70.3 degrees, the other algorithms' median is 8.15" in printed
    _print_run(Run(tmp_path, tuple(WRECKED[:1])), None, as_json=False)
    assert "degrees, the other" not in capsys.readouterr().out

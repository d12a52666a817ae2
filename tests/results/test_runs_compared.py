import lzma

import numpy as np
import pytest

from cembench.core.errors import RecordError
from cembench.report.export import export_rows
from cembench.report.run_tables import changes_table
from cembench.results import runs_compared
from cembench.results.columns import rows
from cembench.results.report_records import has_records, read_rows
from tests.records import changed, record_of
from tests.results.test_comparison import compared_runs as compare_runs


def measured(seconds, kernel):
    return changed(record_of(list(seconds)), {"kernel_seconds": [float(k) for k in kernel]})


def test_a_machine_that_became_slower_is_not_the_algorithm_s_fault():
    rng = np.random.default_rng(2)
    slow = 1.5 * rng.lognormal(0, 0.02, 8)
    before = measured(rng.lognormal(0, 0.02, 8), [1.0] * 8)
    (same,) = compare_runs([before], [measured(slow, [1.5] * 8)])
    assert same.drift == pytest.approx(1.5)
    assert same.comparison.verdict == "undecided"
    assert same.comparison.ratio == pytest.approx(1, abs=0.05)
    (changed,) = compare_runs([before], [measured(slow, [1.0] * 8)])
    assert changed.comparison.verdict == "slower"


def test_what_the_kernel_scatters_widens_the_interval():
    rng = np.random.default_rng(3)
    seconds = rng.lognormal(0, 0.02, (2, 8))
    widths = []
    for scatter in (0.0, 0.3):
        kernels = rng.lognormal(0, scatter, (2, 8))
        (change,) = compare_runs(*([measured(s, k)] for s, k in zip(seconds, kernels, strict=True)))
        widths.append(change.comparison.interval.high / change.comparison.interval.low)
    assert widths[1] > 1.2 * widths[0]


def test_one_run_without_a_kernel_is_enough_for_the_drift_to_be_unknown():
    (change,) = compare_runs([record_of([1.0] * 6)], [measured([1.0] * 6, [1.0] * 6)])
    assert change.drift is None
    assert change.comparison.ratio == 1


def test_equal_runs_are_called_different_in_at_most_5_percent():
    rng = np.random.default_rng(4)
    wrong = 0
    for _ in range(300):
        drift = rng.lognormal(0, 0.3, 2)
        runs = [
            [measured(d * rng.lognormal(0, 0.05, 7), d * rng.lognormal(0, 0.05, 7))] for d in drift
        ]
        wrong += compare_runs(*runs)[0].comparison.verdict != "undecided"
    assert wrong / 300 <= 0.05 + 0.026  # two standard deviations


@pytest.mark.parametrize("packed", [False, True])
def test_a_report_stands_for_its_run(tmp_path, packed):
    rng = np.random.default_rng(5)
    records = [
        measured(rng.lognormal(0, 0.02, 8), rng.lognormal(0, 0.02, 8)),
        record_of([1.0] * 7, algorithm="fdm"),
        record_of([], algorithm="ldm"),
    ]
    run, file = rows(records), tmp_path / "records.csv"
    assert not has_records(tmp_path)
    export_rows(run, file, "csv")
    if packed:
        (tmp_path / "records.csv.xz").write_bytes(lzma.compress(file.read_bytes()))
        file.unlink()
    assert has_records(tmp_path)
    report = read_rows(tmp_path)
    assert [row["parameters"] for row in report] == [row["parameters"] for row in run]
    for pair in ((run, report), (report, run)):
        changes = runs_compared.compare_runs(*pair)
        assert [(c.comparison.ratio, c.drift) for c in changes] == [(1, 1), (1, None)]


def test_records_that_are_no_table_are_refused(tmp_path):
    with pytest.raises(RecordError, match="neither"):
        read_rows(tmp_path)
    packed, file = tmp_path / "records.csv.xz", tmp_path / "records.csv"
    export_rows(rows([record_of([1.0] * 6)]), file, "csv")
    whole = lzma.compress(file.read_bytes())
    for data in (b"not packed", whole[:-20], lzma.compress(b"a,b\n\xff,2\n"), b""):
        packed.write_bytes(data)
        with pytest.raises(RecordError, match="not a table"):
            read_rows(tmp_path)
    packed.unlink()
    text = file.read_text()
    for good, bad in (
        *(("seconds_raw", "other"), ("[1.0, ", "[-1.0, "), ("{}", "[]")),
        ("a,", "a,,,,,,,,,,"),
    ):
        assert good in text
        file.write_text(text.replace(good, bad, 1))
        with pytest.raises(RecordError, match="record 1"):
            read_rows(tmp_path)


def test_runs_that_contradict_each_other_are_named():
    reference = record_of([1.0] * 7, algorithm="cem")
    runs = [
        rows([reference, record_of([seconds] * 7, algorithm="fdm", parameters={"a": k})])
        for k, seconds in enumerate((2.0, 0.5, 1.0))
    ]
    for run in runs:
        run[1]["parameters"] = {}
    changes = runs_compared.compare_runs(runs[0], runs[1])
    assert [change.flipped for change in changes] == [False, True]
    assert not any(change.flipped for change in runs_compared.compare_runs(runs[0], runs[2]))
    assert "they contradict on 1: fdm on" in " ".join(changes_table(changes).notes)

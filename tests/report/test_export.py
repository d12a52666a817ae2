import csv
import json

import pytest
from pyarrow import parquet

from cembench.core.errors import RecordError
from cembench.report.export import export_rows
from cembench.results.columns import row, rows
from tests.records import record_of

RECORDS = [
    record_of([2.0] * 6, algorithm="slow", parameters={"steps": 3}),
    record_of([1.0] * 6, algorithm="cem"),
    record_of([], algorithm="broken", parameters={"steps": "many"}),
]


def test_rows_compare_with_the_reference():
    slow, cem, broken = rows(RECORDS)
    assert (slow["speedup"], slow["verdict"], slow["reference"]) == (1, "slower", "cem")
    assert (slow["speedup_low"], slow["speedup_high"]) == (1, 1)
    assert cem["speedup"] is cem["verdict"] is broken["speedup"] is None
    assert rows(RECORDS, "slow")[1]["verdict"] == "faster"
    assert slow["seconds_raw"] == [2.0] * 6
    assert slow["seconds_calls"] == [[2.0]] * 6
    assert broken["seconds"] is broken["seconds_min"] is None


def test_every_format_holds_every_row_and_column(tmp_path):
    exported = rows(RECORDS)
    for form in ("csv", "parquet", "json"):
        export_rows(exported, tmp_path / form, form)
    assert json.loads((tmp_path / "json").read_text()) == exported
    with (tmp_path / "csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["algorithm"] for line in lines] == ["slow", "cem", "broken"]
    assert json.loads(lines[0]["seconds_raw"]) == [2.0] * 6
    table = parquet.read_table(tmp_path / "parquet").to_pylist()
    assert [set(line) for line in table] == [set(exported[0])] * 3
    assert table[0]["seconds_calls"] == [[2.0]] * 6
    assert json.loads(table[2]["parameters"]) == {"steps": "many"}


def test_an_export_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="cannot be written"):
        export_rows([row(RECORDS[0])], tmp_path / "file/rows.csv", "csv")

"""Runs of one algorithm with other parameters are another algorithm on the leaderboard."""

from dataclasses import replace

from cembench.report.document import Table, items_of
from cembench.report.leaderboard import Entrant, leaderboard


def test_an_algorithm_with_other_parameters_has_a_row_of_its_own(evidence):
    def longer(record):
        if record.cell.algorithm != "cem":
            return record
        parameters = {**record.cell.parameters, "max_iterations": 300}
        cell = record.cell.model_copy(update={"parameters": parameters})
        return record.model_copy(update={"cell": cell})

    other = replace(evidence, records=tuple(map(longer, evidence.records)))
    runs = [Entrant("a", evidence), Entrant("b", evidence), Entrant("c", other)]
    tables = {table.name: table for table in items_of(leaderboard(runs, ""), Table)}
    for name in ("angles-disk", "success-by-family"):
        labels = [row[0].text for row in tables[name].rows]
        assert {"CEM", "CEM (max_iterations=300)"} <= set(labels)
        assert sum(label.startswith("FDM") for label in labels) == 1


def test_algorithms_of_one_title_are_told_apart(evidence):
    def renamed(record):
        cell = record.cell.model_copy(update={"algorithm": "mine"})
        return record.model_copy(update={"cell": cell, "title": "FDM"})

    own = tuple(renamed(r) for r in evidence.records if r.cell.algorithm == "fdm")
    runs = [Entrant("a", evidence), Entrant("b", replace(evidence, records=own))]
    tables = {table.name: table for table in items_of(leaderboard(runs, ""), Table)}
    labels = [row[0].text for row in tables["success-by-family"].rows]
    assert {"FDM (fdm)", "FDM (mine)"} <= set(labels)

"""Runs of one algorithm with other parameters are another algorithm on the leaderboard."""

from dataclasses import replace

from cembench.sharing.leaderboard import Entrant, leaderboard

from cembench.report.document import Table, items_of
from tests.report.conftest import drawing_little


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
    for name in ("ranked-disk", "success-by-family"):
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


def test_it_opens_with_a_ranked_table_for_each_target_and_a_plot(evidence, tmp_path):
    def freed(record):
        cell = record.cell.model_copy(update={"algorithm": "mine"})
        return record.model_copy(update={"cell": cell, "title": "Mine"})

    mine = tuple(freed(r) for r in evidence.records if r.cell.algorithm == "lscm")
    both = replace(evidence, records=(*evidence.records, *mine))
    with drawing_little():
        report = leaderboard([Entrant("a", both)], "", tmp_path)
    disk, free = report.findings.tables
    assert (disk.name, free.name) == ("ranked-disk", "ranked-free-boundary")
    assert {row[0].text for row in free.rows} == {"LSCM", "Mine"}
    assert not {"LSCM", "Mine"} & {row[0].text for row in disk.rows}
    means = [row[1].number for row in disk.rows]
    assert means == sorted(means)
    assert all(row[1].record for row in disk.rows)
    assert report.findings.plot.name == "leaders"
    assert (tmp_path / report.findings.plot.files[0]).is_file()
    assert "a free boundary: on average LSCM has the smallest" in report.findings.sentences[0][0]
    for table in (disk, free):
        place = [column.group for column in table.columns].index("at equal angles")
        fastest = [row[place] for row in table.rows if row[place].number == 1]
        assert all(value.record for value in fastest)
        assert len(fastest) >= 1


def test_what_is_not_repeatable_is_not_called_the_fastest(evidence):
    def scattered(record):
        if record.cell.algorithm != "cem":
            return record
        rounds = [one.model_copy(update={"differs": True}) for one in record.outcome.rounds]
        outcome = record.outcome.model_copy(update={"rounds": tuple(rounds)})
        return record.model_copy(update={"outcome": outcome})

    def fastest(records):
        runs = [Entrant("a", replace(evidence, records=records))]
        table = next(t for t in items_of(leaderboard(runs, ""), Table) if t.name == "ranked-disk")
        place = [column.title for column in table.columns].index("fastest")
        return {row[0].text: row[place].number for row in table.rows}

    assert fastest(evidence.records)["CEM"] >= 1
    assert not fastest(tuple(map(scattered, evidence.records)))["CEM"]

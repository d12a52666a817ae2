from cembench.report.content.evidence import Evidence
from cembench.report.run_tables import contest_tables, results_table, speedups_table
from cembench.results.records import Neighbours
from cembench.results.store import Store
from tests.records import changed, record_of
from tests.terminal import printed


def records_of(rounds, *algorithms):
    return [
        record_of([seconds] * rounds, algorithm=name, mesh=mesh, mesh_hash=mesh)
        for mesh in ("hat", "foot")
        for name, seconds in (("cem", 1.0), *algorithms)
    ]


def test_with_too_few_rounds_a_surface_has_a_line_and_the_doubt_is_said_once():
    text = printed(speedups_table(records_of(1, ("fdm", 3.0), ("lscm", 0.5)), "cem"))
    assert text.count("There are no intervals") == 1
    assert "too few" not in text
    lines = [line.split() for line in text.splitlines()]
    assert ["surface", "fdm", "lscm"] in lines
    assert ["hat", "2.00", "-0.50"] in lines
    assert ["foot", "2.00", "-0.50"] in lines


def test_with_enough_rounds_every_comparison_has_its_interval_and_verdict():
    text = printed(speedups_table(records_of(6, ("fdm", 3.0)), "cem"))
    assert "2.00 to 2.00" in text
    assert text.count("slower") == 2
    assert "How sure" not in text


def test_without_the_reference_there_is_no_table():
    assert speedups_table([record_of([1.0], algorithm="fdm")], "cem") is None


def test_verdicts_of_a_table_hold_together_and_what_that_costs_is_said():
    near = [1.02, 1.05, 1.3, 1.9, 2.5, 1.6]
    cells = [
        record_of(times, algorithm=name, mesh=mesh, mesh_hash=mesh)
        for mesh in ("hat", "foot")
        for name, times in (("cem", [1.0] * 6), ("fdm", near))
    ]
    text = " ".join(printed(speedups_table(cells, "cem")).split())
    assert text.count("undecided") == 2
    assert "(Holm, 2 comparisons)" in text
    assert "Taken alone, 2 more would be called different" in text
    assert "Holm" not in printed(speedups_table(cells[:2], "cem"))


def test_a_busy_machine_is_told_once(tmp_path):
    def results_of(record):
        return printed(results_table(Evidence(Store(tmp_path), (record,), ())))

    record = record_of([1.0] * 6)
    beside = [Neighbours(other_cores=one) for one in (1.0, 1.0, 0.0, 0.0, 0.0, 0.0)]
    text = results_of(changed(record, {"neighbours": beside}))
    assert "busy during 2 of 6 processes" in text
    assert "busy" not in results_of(record)


def test_algorithms_with_a_free_boundary_are_compared_with_each_other_too():
    free = [
        changed(record_of([s] * 6, algorithm=name), target="free boundary")
        for name, s in (("lscm", 2.0), ("mine", 1.0))
    ]
    disk = changed(record_of([1.0] * 6, algorithm="cem"), target="disk")
    both, own = map(printed, contest_tables([disk, *free], "cem"))
    assert "Speedup of cem over the others" in both
    assert "Speedup of lscm over the others" in own
    assert "faster" in own

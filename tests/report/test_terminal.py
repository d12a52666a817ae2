from io import StringIO

from rich.console import Console

from cembench.report.render.terminal import speedups_table
from tests.results.test_comparison import record_of


def printed(records):
    console = Console(width=80, record=True, file=StringIO())
    console.print(speedups_table(records, "cem"))
    return console.export_text()


def records_of(rounds, *algorithms):
    return [
        record_of([seconds] * rounds, algorithm=name, mesh=mesh, mesh_hash=mesh)
        for mesh in ("hat", "foot")
        for name, seconds in (("cem", 1.0), *algorithms)
    ]


def test_with_too_few_rounds_a_surface_has_a_line_and_the_doubt_is_said_once():
    text = printed(records_of(1, ("fdm", 3.0), ("lscm", 0.5)))
    assert text.count("How sure these are is not known") == 1
    assert "too few" not in text
    lines = [line.split() for line in text.splitlines()]
    assert ["surface", "fdm", "lscm"] in lines
    assert ["hat", "2.00", "-0.50"] in lines
    assert ["foot", "2.00", "-0.50"] in lines


def test_with_enough_rounds_every_comparison_has_its_interval_and_verdict():
    text = printed(records_of(6, ("fdm", 3.0)))
    assert "2.00 to 2.00" in text
    assert text.count("slower") == 2
    assert "How sure" not in text


def test_without_the_reference_there_is_no_table():
    assert speedups_table([record_of([1.0], algorithm="fdm")], "cem") is None

import io
from types import SimpleNamespace

import pytest
from rich.console import Console

from cembench.commands.progress import LiveProgress, PlainProgress, Remaining, duration
from cembench.running.watcher import Step
from tests.records import record_of


def test_what_remains_is_judged_by_each_cell_s_last_process():
    remaining = Remaining()
    remaining.expect(9)
    assert remaining.seconds is None
    remaining.ended("slow", left=2, seconds=10)
    remaining.ended("quick", left=2, seconds=1)
    assert remaining.seconds == pytest.approx(2 * 10 + 2 * 1 + 3 * 5.5)
    remaining.finished("slow")
    assert remaining.seconds == pytest.approx(2 * 1 + 3 * 5.5)


def test_no_more_remains_than_of_the_budget_while_something_is_left_of_it(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("cembench.commands.progress.monotonic", lambda: now[0])
    remaining = Remaining(budget=60)
    remaining.expect(10)
    remaining.ended("slow", left=9, seconds=10)
    assert remaining.seconds == 60
    now[0] = 25.0
    assert remaining.seconds == 35
    now[0] = 61.0
    assert remaining.seconds == 90


@pytest.mark.parametrize(("seconds", "said"), [(40, "40 s"), (600, "10 min"), (7200, "2.0 h")])
def test_durations_are_said_as_a_person_would(seconds, said):
    assert duration(seconds) == said


def test_a_line_says_how_far_it_is_after_a_minute_without_one(monkeypatch):
    task = SimpleNamespace(cell=record_of([0.25]).cell)
    console = Console(file=io.StringIO(), width=80)
    progress = PlainProgress(console, 3)
    progress.begins(14)
    progress.starts(task, Step())
    progress.ends(task, Step(), 2.0)
    monkeypatch.setattr(PlainProgress, "EVERY", 0.0)
    progress.ends(task, Step(), 2.0)
    assert console.file.getvalue().splitlines()[1:] == ["2 of 14 processes, about 24 s left"]


def test_the_live_table_shows_cells_and_what_remains():
    record = record_of([0.25])
    task = SimpleNamespace(cell=record.cell)
    console = Console(file=io.StringIO(), width=80, force_terminal=True)
    with LiveProgress(console, 3) as progress:
        progress.begins(14)
        progress.starts(task, Step())
        progress.ends(task, Step(), 2.0)
        progress.starts(task, Step(1, 6))
        progress.waits()
        shown = Console(file=io.StringIO(), width=80)
        shown.print(progress._picture())
        progress.finished(task, record, kept=False)
        shown.print(progress._picture())
    said = shown.file.getvalue()
    for words in ("round 1 of 6", "0/3 cells", "about 26 s left", "waiting", "ok  0.250 s"):
        assert words in said
    assert max(map(len, said.splitlines())) <= 80

import gc
import os
from functools import cache
from pathlib import Path

import pytest
import typer

from cembench.commands.cli import app, main

pytest_plugins = ["tests.shared_server"]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One more than there are cores: now and then a worker waits for a process that it started."""
    return len(os.sched_getaffinity(0)) + 1 if hasattr(os, "sched_getaffinity") else None


@pytest.fixture(scope="session", autouse=True)
def nothing_waits_for_the_disk():
    """Files are in place when they are renamed; only a loss of power needs them to be flushed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda file: None)
        yield


@pytest.fixture(scope="module", autouse=True)
def without_old_objects():
    """What is loaded already need not be looked at by the collection before each measured call.

    A process of the whole suite holds half a million objects, which took a tenth of a second for
    every call that a test measures.
    """
    gc.collect()
    gc.freeze()


@pytest.fixture
def count_calls(monkeypatch):
    """Replace a method by one that counts: ``calls = count_calls(Class, "method")``; len(calls)."""

    def watch(owner, name):
        calls, original = [], getattr(owner, name)

        def counted(*arguments, **options):
            calls.append(name)
            return original(*arguments, **options)

        monkeypatch.setattr(owner, name, counted)
        return calls

    return watch


@cache
def _commands():
    """All commands, made once: making them takes longer than most calls."""
    return typer.main.get_command(app)


@pytest.fixture
def cli(capsys, monkeypatch, tmp_path):
    """Run the command line in an empty folder: exit code, standard output, standard error.

    As on one core: where there are more, commands start processes to share their work.
    """
    workplace = tmp_path / "workplace"
    workplace.mkdir()
    monkeypatch.chdir(workplace)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("cembench.running.environment.usable_cores", lambda: 1)
    monkeypatch.setattr("cembench.commands.app.app", _commands())

    def call(*arguments):
        monkeypatch.setattr("sys.argv", ["cembench", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        said = capsys.readouterr()
        return stopped.value.code or 0, said.out, said.err

    call.folder = Path(workplace)
    return call

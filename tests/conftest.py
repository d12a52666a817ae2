import gc
import os
import sys
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


#: Files that take a quarter of a minute or more, whatever their number of tests.
LONG = (
    "fuzz/test_campaign.py",
    "report/test_report.py",
    "running/test_local.py",
    "meshes_gen/test_catalogue.py",
    "running/cluster/test_client.py",
    "running/test_cheats.py",
    "running/test_pairing.py",
    "commands/test_from_api.py",
    "commands/test_cli.py",
    "commands/test_reproduce.py",
    "running/test_killed.py",
    "test_files_of_the_user.py",
    "validation/test_validate_verbs.py",
    "commands/test_exit_codes.py",
    "test_fuzzed_run.py",
    "api/test_api.py",
    "mesh/test_unpacking.py",
    "algorithms/test_published.py",
    "report/test_html_browser.py",
    "sharing/test_results_repository.py",
)


#: What the tests of a room cost, unless one is marked otherwise; those of all other rooms start
#: processes.
COSTS = {
    **dict.fromkeys(("algorithms", "conformal", "core", "drawing", "linear_algebra"), "pure"),
    **dict.fromkeys(("mesh", "meshes_gen", "results"), "pure"),
    **dict.fromkeys(("docs", "papers", "report", "sharing", "textures"), "product"),
}
#: What a test that is marked `pure` does not do.
STARTS = ("os.fork", "os.forkpty", "os.posix_spawn", "os.system", "subprocess.Popen")


def pytest_itemcollected(item):
    """Mark what each test costs."""
    if not any(item.get_closest_marker(name) for name in ("pure", "process", "product")):
        room = Path(item.nodeid.partition("::")[0]).parts[1]
        item.add_marker(COSTS.get(room, "process"))


_in_pure = []


@pytest.fixture(autouse=True)
def pure_tests_start_no_process(request):
    """Refuse a process to a pure test, whose mark would be wrong."""
    _in_pure[:] = [request.node.nodeid] if request.node.get_closest_marker("pure") else []
    yield
    _in_pure.clear()


def _refuse(event, arguments):
    if _in_pure and event in STARTS:
        raise RuntimeError(f"{_in_pure[0]} starts a process: mark it with pytest.mark.process")


sys.addaudithook(_refuse)


def pytest_collection_modifyitems(config, items):
    """Begin with the long files where several processes share them: none is left for the end."""
    if hasattr(config, "workerinput"):
        first = {f"tests/{name}": place for place, name in enumerate(LONG)}
        items.sort(key=lambda item: first.get(item.nodeid.partition("::")[0], len(LONG)))


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
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    monkeypatch.setattr("cembench.commands.app.app", _commands())

    def call(*arguments):
        monkeypatch.setattr("sys.argv", ["cembench", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        said = capsys.readouterr()
        return stopped.value.code or 0, said.out, said.err

    call.folder = Path(workplace)
    return call

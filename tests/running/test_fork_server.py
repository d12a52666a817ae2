import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from cembench.results.records import Outcome, Round
from cembench.running.environment import for_measuring
from cembench.running.fork_server import ForkServer, ServerGoneError, can_fork
from cembench.running.map_checks import Checked
from cembench.running.options import Options
from cembench.running.timing import CellTimer
from tests.running.test_local import MEMORY, tasks_of

pytestmark = pytest.mark.skipif(not can_fork(1), reason="processes are not forked here")


@pytest.fixture
def timer(tmp_path):
    made = CellTimer(tmp_path, Options())
    yield made
    made.close()


def timed(timer, name, **how):
    return timer.time(tasks_of(name, **how)[0], Checked())


def test_processes_of_a_round_are_forked_from_one_server_until_it_is_closed(timer):
    assert isinstance(timed(timer, "good"), Round)
    first = timer.launcher._server.pid
    assert isinstance(timed(timer, "good"), Round)
    assert timer.launcher._server.pid == first
    timer.close()
    assert not psutil.pid_exists(first)
    assert isinstance(timed(timer, "good"), Round)
    assert timer.launcher._server.pid != first


def test_a_forked_process_finds_pinned_threads_its_own_group_and_no_algorithm_loaded(timer):
    timed(timer, "harmonic-circle")
    forked = timed(timer, "tells-where").cause
    assert forked.endswith("fork_server.py 1 True [] 0")
    threaded = timed(timer, "tells-where", threads=2).cause
    assert threaded.endswith("worker.py 2 True [] 0")
    for told in (forked, threaded):
        assert "glibc.malloc.hugetlb=" in told


@pytest.mark.usefixtures("kept_servers")
@pytest.mark.parametrize(
    ("name", "status", "cause"),
    [
        ("segfaults", "failed", "ended by signal SIGSEGV"),
        ("talks-and-dies", "failed", "ended with code 7: the last words"),
        ("raises", "failed", "ZeroDivisionError: by nothing"),
        ("hoards", "out_of_memory", "the limit is 500 MiB"),
        ("spins", "timeout", "not finished after 2 s"),
    ],
)
def test_a_fault_in_a_forked_process_is_a_status_and_the_next_is_measured(
    timer, name, status, cause
):
    timer.launcher.options = Options(timeout=1 if name == "spins" else 600, memory_bytes=MEMORY)
    result = timed(timer, name)
    timer.launcher.options = Options(memory_bytes=MEMORY)
    assert (result.status, cause in result.cause) == (status, True), result.cause
    server = timer.launcher._server.pid
    assert isinstance(timed(timer, "good"), Round)
    assert timer.launcher._server.pid == server


@pytest.mark.parametrize("name", ["daemonises", "detaches-twice"])
def test_what_a_forked_process_leaves_is_ended(timer, name, tmp_path, monkeypatch):
    monkeypatch.setenv("FAULTY_CHILDREN", str(tmp_path / "children"))
    result = timed(timer, name)
    # A child may still be starting beside the next call, and then that is what is told.
    assert isinstance(result, Round) or result.status == "not_comparable", result
    children = (tmp_path / "children").read_text().split()
    assert len(children) > 1  # a warm-up, and a call
    for child in map(int, children):
        assert not psutil.pid_exists(child) or (
            psutil.Process(child).status() == psutil.STATUS_ZOMBIE
        )


def test_what_takes_off_all_marks_and_is_ever_another_process_is_ended(
    timer, tmp_path, monkeypatch
):
    file = tmp_path / "children"
    monkeypatch.setenv("FAULTY_CHILDREN", str(file))
    assert timer.check(tasks_of("hops")[0])[0].status == "ok"
    before = file.read_text()
    time.sleep(0.2)
    assert file.read_text() == before
    assert not psutil.Process(timer.launcher._server.pid).children()


def test_the_global_generator_differs_from_process_to_process(timer):
    (task,) = tasks_of("draws")
    checked, _ = timer.check(task)
    measured = [timer.time(task, Checked.of(checked)) for _ in range(2)]
    assert [one.repeated for one in measured] == [False, False]


def test_without_its_server_a_process_has_failed_and_the_next_is_measured(timer):
    result = timed(timer, "kills-its-parent")
    assert isinstance(result, Outcome)
    assert "ended by signal SIGKILL" in result.cause
    assert isinstance(timed(timer, "good"), Round)
    assert timer.launcher.forks


@pytest.mark.parametrize("read", [0, 3])
def test_a_request_that_a_signal_cut_short_leaves_no_answer_to_the_next(tmp_path, read):
    """As many bytes of the answer had been read; the process had ended, or had not."""
    (tmp_path / "log").touch()
    server = ForkServer(for_measuring(1), "cvxopt")
    forked = server.forking(tmp_path / "no job")("0" * 32, tmp_path / "log")
    asks, answers = server._process.stdin, server._process.stdout
    for _ in range(2):
        asks.write(b'[0, "poll"]\n')
        answers.read(read)
        code = forked.wait()
        assert code > 0
        forked.code = None
    assert forked.wait() == code
    server.close()


def test_without_a_server_processes_are_started(timer, monkeypatch):
    monkeypatch.setattr("cembench.running.launcher.can_fork", lambda threads: False)
    assert timed(timer, "tells-where").cause.endswith("worker.py 1 True [] 0")
    monkeypatch.undo()
    monkeypatch.setattr("cembench.running.fork_server.sys.executable", "/bin/false")
    with pytest.raises(ServerGoneError):
        ForkServer(for_measuring(1), "cvxopt")


def test_the_server_ends_with_the_one_that_started_it():
    script = (
        "import os, time; from cembench.running.environment import for_measuring;"
        "from cembench.running.fork_server import ForkServer;"
        "print(ForkServer(for_measuring(1), 'cvxopt').pid, flush=True); time.sleep(600)"
    )
    run = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    server = psutil.Process(int(run.stdout.readline()))
    os.kill(run.pid, signal.SIGKILL)
    run.communicate()
    while server.is_running() and server.status() != psutil.STATUS_ZOMBIE:
        time.sleep(0.01)  # for ever, should it not end: how long that takes is up to the machine

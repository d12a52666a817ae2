"""Whatever a command leaves behind is found and ended."""

import os
import subprocess
import sys

import psutil
import pytest

from cembench.core.notices import NoticeKind
from cembench.results.records import Outcome
from cembench.running import launcher, process
from cembench.running.process import Limits, run_limited, spawning
from cembench.running.worker import Answer

#: Starts a process with another environment, session and parent, writes its id, and ends at once.
ORPHAN = """
import os, sys
def forked():
    if os.fork(): os._exit(0)
reading, writing = os.pipe()
if os.fork() == 0:
    os.setsid()
    forked()
    open(sys.argv[1], "w").write(str(os.getpid()))
    os.close(writing)
    os.closerange(3, 100)
    os.execve("/bin/sleep", ["sleep", "600"], {})
os.close(writing)
os.read(reading, 1)
os._exit(0)
"""


def ended(pid):
    """Whether a process has ended, be it that nobody has asked for its exit code yet."""
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@pytest.mark.skipif(sys.platform != "linux", reason="NOT CHECKED: only Linux inherits the limit")
def test_a_double_fork_with_an_empty_environment_is_ended(tmp_path):
    bystander = subprocess.Popen(["sleep", "600"], env={})
    start = spawning([sys.executable, "-c", ORPHAN, str(tmp_path / "pid")], dict(os.environ))
    try:
        end = run_limited(start, Limits(60), tmp_path / "log")
        pid = int((tmp_path / "pid").read_text())
        assert (end.code, end.left) == (0, 1)
        assert ended(pid)
        assert bystander.poll() is None
    finally:
        bystander.kill()
        bystander.wait()


def test_a_record_says_what_may_live_on_where_it_cannot_be_found(monkeypatch):
    answer = Answer(outcome=Outcome(status="ok"))
    for finds, hidden in ((True, False), (False, True)):
        monkeypatch.setattr(launcher, "finds_all", lambda finds=finds: finds)
        (note,) = launcher._with_note(answer, 2).outcome.notes
        assert note.kind is NoticeKind.PROCESSES_LEFT
        assert ("may live on" in note.text) is hidden


def test_without_a_limit_to_mark_by_the_environment_is_the_mark(tmp_path, monkeypatch):
    monkeypatch.setattr(process, "_LIMIT", None)
    code = "import os\nif os.fork() == 0: os.setsid(); os.execv('/bin/sleep', ['sleep', '600'])"
    end = run_limited(
        spawning([sys.executable, "-c", code], dict(os.environ)), Limits(60), tmp_path / "log"
    )
    assert end.left == 1

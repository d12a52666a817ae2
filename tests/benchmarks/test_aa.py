import json
import signal
import subprocess
import sys
import time

import psutil
import pytest

from benchmarks import aa
from tests.records import record_of


def run(twin, other):
    return [
        record_of([1.0, 1.1, 0.9, 1.05, 0.95, 1.02], algorithm="cem"),
        record_of([twin * s for s in (1.0, 1.1, 0.9, 1.05, 0.95, 1.02)], algorithm="cem-twin"),
        record_of([other * s for s in (1.0, 1.1, 0.9, 1.05, 0.95, 1.02)], algorithm="ldm"),
    ]


def test_what_is_called_different_is_counted_with_its_interval(tmp_path):
    summary = aa.summarise([run(1.0, 3.0), run(1.2, 3.0), run(1.0, 4.0)], ["cem", "ldm"])
    assert (summary["comparisons"], summary["called_different"]) == (3, 1)
    assert summary["interval"] == (pytest.approx(0.0084, abs=1e-3), pytest.approx(0.906, abs=1e-3))
    assert (summary["speedups_compared"], summary["speedups_overlapping"]) == (3, 1)
    assert summary["largest_difference"] == pytest.approx(1 / 3)
    (tmp_path / "busy.json").write_text(json.dumps(summary))
    text = str(aa.section(tmp_path))
    assert "| beside a busy neighbour | 3 | 3 | 1 (33.3%) |" in text
    assert "| quiet |" not in text


def test_busy_loops_end_with_the_block():
    before = subprocess.Popen
    started = []

    class Noted(before):
        def __init__(self, *arguments, **more):
            super().__init__(*arguments, **more)
            started.append(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(subprocess, "Popen", Noted)
        with pytest.raises(ValueError, match="on purpose"):
            _fail_beside(2, started)
    assert all(process.poll() is not None for process in started)
    assert started[0].args[0] == sys.executable


@pytest.mark.slow
def test_a_stopped_study_leaves_nothing_running_and_goes_on_when_called_again(tmp_path):
    command = [sys.executable, "-m", "benchmarks", "aa", "--busy", "1", "--runs", "1"]
    command += ["--surfaces", "flat-disk", "--faces", "100", "--algorithms", "cem,lscm"]
    command += ["--output", str(tmp_path)]
    started = subprocess.Popen(
        command, preexec_fn=lambda: signal.signal(signal.SIGTERM, signal.SIG_DFL)
    )
    while not list(tmp_path.glob("busy/run-00/samples/*/*.jsonl")):
        assert started.poll() is None
        time.sleep(0.1)
    below = psutil.Process(started.pid).children(recursive=True)
    assert len(below) >= 3  # the loop, the run and its timed process
    started.terminate()
    assert started.wait() == 128 + signal.SIGTERM
    assert not psutil.wait_procs(below, timeout=10)[1]
    again = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "| beside a busy neighbour | 1 | 2 |" in again.stdout


def _fail_beside(number, started):
    with aa.neighbours(number):
        assert [process.poll() for process in started] == [None] * number
        raise ValueError("on purpose")

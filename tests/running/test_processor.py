"""CPU seconds of this process and of what it started."""

import subprocess
import sys
from itertools import pairwise

import pytest

from cembench.running.processor import STARTING, Processor, after_call, before_call


def test_looking_at_a_child_that_sleeps_is_no_work_of_the_solver_s():
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        moments = [moment for _ in range(50) for moment in (before_call(), after_call())]
        between = list(pairwise(moments))[1::2]
        assert all(child.pid in moment.children for moment in moments)
        looked = sum(a.looking + b.looking for a, b in between)
        used = sum(b.thread - a.thread for a, b in between)
        assert 0.9 * used < looked < used
    finally:
        child.communicate(b"\n")


def test_the_start_of_a_child_is_excused_and_its_work_is_not():
    def moment(**children):
        return Processor(1.0, 1.0, children={int(pid[1:]): s for pid, s in children.items()})

    before, started = moment(p1=5.0), moment(p1=5.0, p2=0.3)
    assert started.starts_since(before) == pytest.approx(0.3)
    assert started.beside - before.beside - started.starts_since(before) == pytest.approx(0)
    later = moment(p1=6.0, p2=3.0)
    assert later.starts_since(started) == pytest.approx(STARTING - 0.3)
    assert later.beside - started.beside - later.starts_since(started) == pytest.approx(3.0)


def test_a_call_s_new_process_is_waited_for_until_it_sleeps():
    before = before_call()
    busy = "import time\nwhile time.process_time() < 0.3: pass\ninput()"
    child = subprocess.Popen([sys.executable, "-c", busy], stdin=subprocess.PIPE)
    try:
        after = after_call(before)
        assert before_call().children[child.pid] - after.children.get(child.pid, 0.0) > 0.2
        assert after.looking < 0.2
    finally:
        child.communicate(b"\n")


LIMITED = """
import resource
from itertools import pairwise
from time import perf_counter
from cembench.running.processor import after_call, before_call

def work(seconds):
    end = perf_counter() + seconds
    while perf_counter() < end:
        pass

resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
moments = []
for _ in range(100):
    moments.append(before_call())
    work(0.003)
    moments.append(after_call())
    work(0.0005)
between = list(pairwise(moments))[1::2]
print(sum(b.beside - a.beside for a, b in between))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has such a limit and clock")
def test_under_a_limit_of_cpu_time_a_process_s_own_work_is_not_taken_for_another_thread_s():
    ended = subprocess.run(
        [sys.executable, "-c", LIMITED], capture_output=True, text=True, check=True
    )
    assert abs(float(ended.stdout)) < 0.01

"""CPU seconds of this process and of what it started."""

import subprocess
import sys

import pytest

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

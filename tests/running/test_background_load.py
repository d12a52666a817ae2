import os
import subprocess
import sys

import pytest

from cembench.results.records import Neighbours
from cembench.running import reference_kernel
from cembench.running.background_load import Counters, _sum, counters, neighbours
from cembench.running.reference_kernel import kernel_seconds


def test_what_others_did_is_what_ours_did_not():
    before = Counters(worked=100.0, stolen=5.0, throttles=3, at=0.0)
    after = Counters(worked=103.0, stolen=5.2, throttles=4, at=2.0)
    load = neighbours(before, after, threads=1)
    assert (load.other_cores, load.stolen_cores, load.throttled) == (0.5, 0.1, True)
    assert load.busy
    assert neighbours(before, after, threads=2).other_cores == 0


@pytest.mark.parametrize(
    ("seen", "busy"),
    [
        (Neighbours(other_cores=0.2), False),
        (Neighbours(other_cores=0.2, stolen_cores=0.1), True),
        (Neighbours(other_cores=0, throttled=False), False),
        (Neighbours(other_cores=0, throttled=True), True),
    ],
)
def test_a_quarter_of_a_core_is_busy(seen, busy):
    assert seen.busy is busy


def test_the_system_counts_on():
    first, later = counters(), counters()
    assert first.worked <= later.worked
    assert first.at <= later.at


def test_counts_of_heat_are_added_where_they_can_be_read(tmp_path):
    assert _sum([tmp_path / "none"]) is None
    for name, count in (("a", "2\n"), ("b", "3\n"), ("c", "?")):
        (tmp_path / name).write_text(count)
    assert _sum(sorted(tmp_path.iterdir())) == 5


def test_the_kernel_takes_time():
    assert kernel_seconds() > 0


def test_the_kernel_is_repeated_for_rounds_of_many_processes(monkeypatch):
    seconds = iter([9.0, 1.0, 2.0] + 12 * [3.0, 9.0] + 100 * [3.0])
    monkeypatch.setattr(reference_kernel, "_timed", lambda _: next(seconds))
    assert kernel_seconds() == 2.0
    assert kernel_seconds(8) == 6.0
    assert kernel_seconds(1000) == 3.0
    assert len(list(seconds)) == 100 - reference_kernel.AT_MOST


FAULTS = """
import resource
import numpy as np
from cembench.running import reference_kernel
inside, faults = reference_kernel._timed, []
def counted(matrix):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    seconds = inside(matrix)
    faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
    return seconds
reference_kernel._timed = counted
{before}
reference_kernel.kernel_seconds(3)
print(sum(faults) / len(faults))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="this is glibc's allocator")
@pytest.mark.parametrize("before", ["", "large = np.ones(3_000_000); del large"])
def test_the_kernel_s_memory_is_there_whatever_its_process_freed_before(before):
    plain = {k: v for k, v in os.environ.items() if not k.startswith(("GLIBC_", "MALLOC_"))}
    command = [sys.executable, "-c", FAULTS.format(before=before)]
    done = subprocess.run(command, env=plain, capture_output=True, text=True, check=True)
    assert float(done.stdout) < 100

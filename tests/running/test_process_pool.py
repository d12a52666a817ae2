import os
import time

import psutil
import pytest

from cembench.running.process_pool import process_pool


def test_functions_are_called_in_other_processes_and_errors_come_back():
    with process_pool(1) as pool:
        pid = pool.submit(os.getpid).result()
        assert pid != os.getpid()
        with pytest.raises(ZeroDivisionError):
            pool.submit(divmod, 1, 0).result()
    assert not psutil.pid_exists(pid)


def test_an_exception_that_leaves_the_block_kills_what_runs():
    def stopped():
        with process_pool(1) as pool:
            pids.append(pool.submit(os.getpid).result())
            pool.submit(time.sleep, 10_000)
            raise KeyboardInterrupt

    pids = []
    with pytest.raises(KeyboardInterrupt):
        stopped()
    (pid,) = pids
    assert not psutil.pid_exists(pid)


def test_a_process_has_no_more_than_its_memory():
    with process_pool(1, memory_bytes=2**28) as pool:
        # The bound on reserved memory is half as much again and 1 GiB.
        assert len(pool.submit(bytes, 2**20).result()) == 2**20
        with pytest.raises(MemoryError):
            pool.submit(bytes, 2**31).result()

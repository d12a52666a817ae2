import os
import signal

import pytest

from tests.campaign.limited import Limits, run_cases

pytestmark = pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")


def do(case):
    if case == "spins":
        while True:
            pass
    if case == "dies":
        os.kill(os.getpid(), signal.SIGTERM)
    if case == "exits":
        os._exit(0)
    if case == "hoards":
        return {"size": len(bytearray(2**33))}
    if case == "raises":
        raise ValueError("of the instrument")
    return {"case": case}


def test_a_hang_or_crash_is_known_by_its_case_and_costs_no_other():
    cases = ["a", "spins", "b", "dies", "exits", "c", "raises", "d"]
    limits = Limits(cpu_seconds=1, memory_bytes=2**30)
    endings = {e.case: e for e in run_cases(cases, do, limits, slots=2, batch=3)}
    assert {case: endings[case].failure for case in cases} == {
        "a": None,
        "spins": "hang",
        "b": None,
        "dies": "crash",
        "exits": "crash",
        "c": None,
        "raises": "instrument",
        "d": None,
    }
    assert endings["d"].result == {"case": "d"}
    assert "SIGTERM" in endings["dies"].detail


def test_memory_is_limited():
    (ending,) = run_cases(["hoards"], do, Limits(memory_bytes=2**30), slots=1)
    assert "MemoryError" in ending.detail

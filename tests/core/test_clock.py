import pytest

from cembench.core import clock
from cembench.core.clock import measure, phase


def test_phases_exclude_what_is_nested_and_add_up_to_the_total():
    now = [100.0]

    def wait(seconds):
        now[0] += seconds

    def work():
        with phase("outer"):
            wait(2)
            with phase("inner"):
                wait(3)
            with phase("inner"):
                wait(1)
        wait(5)
        return "done"

    result, timing = measure(work, lambda: now[0])
    assert result == "done"
    assert timing.phases == {"outer": 2, "inner": 4, "other": 5}
    assert timing.total == 11


def test_a_plug_in_cannot_replace_the_clock_in_the_module(monkeypatch):
    def work():
        monkeypatch.setattr(clock, "perf_counter", lambda: 0.0)

    assert 0 < measure(work)[1].total < 60


def test_outside_a_measurement_nothing_is_kept_and_errors_pass_through():
    with phase("alone"):
        pass

    def fail():
        with phase("broken"):
            raise ValueError("cause")

    with pytest.raises(ValueError, match="cause"):
        measure(fail)
    _, timing = measure(lambda: None)
    assert set(timing.phases) == {"other"}

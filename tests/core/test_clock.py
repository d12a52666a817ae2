import time

import pytest

from cembench.core.clock import measure, phase


def test_phases_exclude_what_is_nested_and_add_up_to_the_total():
    def work():
        with phase("outer"):
            time.sleep(0.02)
            with phase("inner"):
                time.sleep(0.03)
            with phase("inner"):
                time.sleep(0.01)
        time.sleep(0.01)
        return "done"

    result, timing = measure(work)
    assert result == "done"
    assert set(timing.phases) == {"outer", "inner", "other"}
    assert timing.phases["inner"] >= 0.04
    assert 0.02 <= timing.phases["outer"] < timing.phases["inner"]
    assert sum(timing.phases.values()) == pytest.approx(timing.total, abs=1e-12)


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

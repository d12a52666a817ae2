import subprocess
import sys

import pytest

from benchmarks.repeatability import summary
from tests.results.test_comparison import record_of


def test_the_table_tells_the_spread_and_the_false_alarms():
    def told(runs):
        return str(summary(runs, "fdm"))

    def run(other, twin):
        return [
            record_of([seconds] * 6, algorithm=name, mesh="hat")
            for name, seconds in (
                ("cem", 1.0),
                ("cem-twin", twin),
                ("fdm", other),
                ("fdm-twin", other),
            )
        ]

    text = told([run(3.0, 1.0), run(3.5, 1.0), run(4.0, 1.1)])
    assert "| hat | 1 | 2.50 | 2.00 | 3.00 | 28.6% |" in text
    assert "A/A: 1 of 6 comparisons of an algorithm with its twin (16.7%)" in text
    assert "a probability of 0.26" in text  # 1 - 0.95^6
    assert "No A/A comparison" in told([[record_of([1.0], algorithm="cem")]])


@pytest.mark.slow
def test_it_measures_twins_once_and_goes_on_when_called_again(tmp_path):
    command = [sys.executable, "-m", "benchmarks", "repeatability", "--runs", "1"]
    command += ["--surfaces", "flat-disk", "--faces", "100", "--against", "harmonic-circle"]
    command += ["--repeats", "1", "--output", tmp_path]
    first, again = (
        subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(2)
    )
    assert "| flat-disk | 96 |" in first.stdout
    assert again.stdout == first.stdout
    assert "4/4] flat-disk / " in first.stderr
    assert again.stderr.count("kept") == 4
    assert "run 1 of 1" in first.stderr

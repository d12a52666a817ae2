"""The guide shows the shipped example as it is, and what `validate` prints but for two tables."""

import re
from pathlib import Path

import pytest

from tests.validation.in_this_process import TimerHere, call_here

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples/stop_at_angles.py"
GUIDE = (ROOT / "docs/write_a_solver.md").read_text()


def shape(text):
    """Words alone: wrapping, figures and the widths of columns may change."""
    text = re.sub(r"\d[\d,.]*(e[-+]\d+)?", "N", " ".join(text.split()))
    return text.replace("- N", "-N")


def documented():
    return GUIDE.split("$ cembench validate examples/stop_at_angles.py\n")[1].split("```")[0]


@pytest.fixture
def printed(cli, monkeypatch):
    monkeypatch.setattr("cembench.validation.solver.in_a_process", lambda options: call_here)
    monkeypatch.setattr("cembench.running.local.CellTimer", TimerHere)
    few = ("--surfaces", "hemi-ellipsoid,cone", "--faces", 600, "--repeats", 1, "--up-to", 900)
    code, out, _ = cli("validate", EXAMPLE, *few)
    assert code == 0
    return out


def test_the_guide_shows_the_example_as_it_is():
    assert f"```python\n{EXAMPLE.read_text()}```" in GUIDE


def test_the_guide_shows_what_validate_prints(printed):
    checks, known = (text.split("Beside the baselines")[0] for text in (printed, documented()))
    assert shape(checks) == shape(known)
    assert re.search(r"surface +faces +angles +ratio +angles +ratio +angles +ratio\n", printed)
    assert re.search(r"\ncem's factorisation +\d", printed)
    for text in (printed, documented()):
        assert re.search(r"growth of the seconds +\w[\w ]+ seconds grow like", text)
        assert "CEM by angles: valid; E_C " in shape(text)
    assert "growth of the seconds ok seconds grow" in shape(printed)
    assert max(map(len, documented().splitlines())) <= 80

"""The fit of levers to printed figures."""

import tomllib

import numpy as np
import pytest
from cembench.surfaces.levers import Levers
from cembench.surfaces.rows import FILE, ROWS

from benchmarks.calibration import BY_LDM, FITTED, descent, ratios, rounded, text_of


def test_the_descent_finds_levers_of_a_known_response():
    """Logarithms that depend on jag, smooth and gain almost linearly, as measured ones do."""
    wanted = np.array([0.4, 0.9, 1.2])
    tried = []

    def errors(levers):
        x = np.array([levers.jag, levers.smooth, levers.gain]) - wanted
        tried.append(levers)
        return np.array([[2.5, -0.2, 0.3], [0.1, -0.4, 0.6], [0.2, -0.1, 0.7]]) @ x + 0.1 * x**2

    descent(Levers(jag=0.2, smooth=2.0, gain=1.0), ("jag", "smooth", "gain"), errors, 12)
    assert np.abs(errors(tried[-1])).max() < 0.012


def test_levers_that_cannot_be_used_shorten_the_steps(monkeypatch):
    from cembench.core.errors import MeshError

    def errors(levers):
        if levers.jag > 0.5:
            raise MeshError("folded in space")
        return np.full(3, levers.jag - 0.45)

    found = []
    descent(Levers(jag=0.1), ("jag",), lambda one: found.append(errors(one)) or found[-1], 12)
    assert min(np.abs(one).max() for one in found) < 0.1


def test_kept_levers_are_written_as_they_are_read():
    assert text_of(ROWS) == FILE.read_text(encoding="utf-8")
    assert set(tomllib.loads(text_of(ROWS))) == set(ROWS)
    assert rounded(Levers(jag=0.123456)).jag == 0.1235


@pytest.mark.parametrize("name", ROWS)
def test_every_row_but_one_is_within_a_tenth_of_its_printed_figures(name):
    row = ROWS[name]
    assert row.fitted == ("ldm" if row.model in BY_LDM else "fdm")
    off = max(abs(ratios(row)[figure] - 1) for figure in FITTED)
    assert off < (0.25 if name == "isis-statue-stand-in" else 0.1)

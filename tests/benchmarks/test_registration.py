"""The registration page says what its CSV says, and its Moebius fit finds a known map."""

import csv

import numpy as np
import pytest
from cembench.papers.cem.morphing.align import to_centre

from benchmarks import registration
from benchmarks.pages import ROOT, Section, filled
from benchmarks.registration import FITTED, METHODS, PAPER, PLAIN, Row, differences, fitted, parts


def table(rows, modes):
    return str(Section(parts(rows, modes)))


def rows_of_page():
    with (ROOT / registration.PAIRS).open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            error = float(row["error_percent"]) if row["error_percent"] else None
            place = int(row["pair"]), row["kind"], row["method"], int(row["landmarks"])
            yield Row(*place, error)


def test_the_page_says_what_the_pairs_say():
    rows = list(rows_of_page())
    assert len(rows) == 30 * len(METHODS)
    page = (ROOT / registration.PAGE).read_text(encoding="utf-8")
    assert filled(page, "registration", table(rows, 4)) == page


def test_with_20_landmarks_the_paper_s_method_is_better_on_every_pair():
    rows = list(rows_of_page())
    change = differences(rows, (PAPER, 20), (PLAIN, 20))
    assert len(change) == 30
    assert max(change) < 0


def test_a_method_that_fails_is_counted_and_left_out_of_the_median():
    rows = [Row(k, "both", *METHODS[0], None if k == 0 else float(k)) for k in range(7)]
    line = next(line for line in table(rows, 4).splitlines() if line.startswith("| Moebius"))
    assert "3.50 [1.00, 6.00]" in line
    assert line.endswith("| 1 |")
    assert differences(rows, METHODS[0], (FITTED, 3)) == []


@pytest.mark.parametrize("turn", [0.3, 2.9, -2.0])
def test_the_fit_finds_a_moebius_map(turn):
    rng = np.random.default_rng(0)
    z = 0.9 * np.sqrt(rng.random(40)) * np.exp(2j * np.pi * rng.random(40))
    move = to_centre(0.5 - 0.3j, turn)
    fit = fitted(z, move(z), np.ones(40))
    assert np.abs(fit(z) - move(z)).max() < 1e-6


def test_pairs_are_a_third_of_each_kind_and_a_person_is_kept_where_only_the_expression_changes():
    specimens = registration.specimens(30)
    assert [sum(kind == k for kind, _, _ in specimens) for k in registration.KINDS] == [10, 10, 10]
    for kind, one, other in specimens:
        assert (one[0] == other[0]) == (kind == "expression")
        assert (other[1] == "neutral") == (kind == "identity")
        assert one[1] == "neutral"

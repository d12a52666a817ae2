"""Table of the exponents with which the cost of a map grows with the number of triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cembench.report.content.evidence import Evidence
from cembench.report.document import Column, Table, Value, count, missing, words
from cembench.report.plot_rows import FEWEST, Fit, fit, printed
from cembench.report.plots import Point

if TYPE_CHECKING:
    import pandas as pd


def exponents_table(evidence: Evidence) -> Table:
    """Return a table of the fitted exponents, printed and measured, with standard errors and n."""
    columns = [Column("algorithm", numeric=False)]
    for group in ("printed", *(f"here, {policy}" for policy in evidence.policies)):
        columns += [Column("exponent", group), Column("n", group)]
    rows = []
    there, measured = printed(evidence), evidence.frame
    for series in evidence.disk_series:
        of_paper = fit(_points(there[there["algorithm"] == series.algorithm]))
        cells = [words(series.label), *_fit_cells(of_paper)]
        own = measured[measured["ok"] & (measured["label"] == series.label)]
        for policy in evidence.policies:
            cells += _fit_cells(fit(_points(own[own["solves"] == policy])))
        rows.append(tuple(cells))
    return Table(
        "exponents",
        "Fitted exponents: seconds grow as the number of triangles to this power",
        tuple(columns),
        tuple(rows),
        "Least squares of logarithms; ± one standard error. Iterations also "
        "differ between surfaces.",
        (f"an exponent needs at least {FEWEST} sizes",),
    )


def _points(frame: pd.DataFrame) -> list[Point]:
    known = frame[frame["seconds"] > 0]
    return [Point(*pair) for pair in zip(known["faces"], known["seconds"], strict=True)]


def _fit_cells(law: Fit | None) -> list[Value]:
    if law is None:
        return [missing(f"fewer than {FEWEST} sizes"), missing("no fit")]
    text = f"{law.exponent:.2f} ± {law.error:.2f}"
    return [Value(text, law.exponent, "derived"), count(law.n)]

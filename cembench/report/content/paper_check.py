"""What is wrong with a paper's folder, found before anything is measured for it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from decimal import Decimal

from cembench.core.errors import CembenchError, ParameterError
from cembench.core.names import did_you_mean
from cembench.registry import Registry
from cembench.report.content.evidence import FRAME_COLUMNS
from cembench.results.columns import COLUMNS
from cembench.results.expressions import names_in
from cembench.results.frame import FUNCTIONS, unknown
from cembench.results.papers import Paper, StatedClaim

#: Names that claims know besides those of the paper.
KNOWN = (
    *("disk", "under", "printed", "models_of", "exhibits_of", "tables", "compared", "reference"),
    *("held", "tested", "of", "lacking", "holds"),
)
#: Columns that claims have besides those of the frame.
OF_CLAIMS = ("policy", "chosen", "printed_rate", "below_one")


def wrong_with(paper: Paper, registry: Registry) -> Iterator[str]:
    """Yield what is wrong with a paper that could be read: names, expressions, and digits."""
    yield from _algorithms(paper, registry)
    yield from _surfaces(paper, registry)
    yield from _digits(paper)
    try:
        functions = paper.functions()
    except CembenchError as error:
        yield str(error)
        return
    for claim in paper.claims:
        yield from _claim(paper, claim, functions, registry)


def _misspelt(where: str, names: Iterable[str], known: Iterable[str]) -> Iterator[str]:
    """Yield the names that are nearly known; others are of plug-ins, programs or files."""
    held = list(known)
    for name in names:
        if name not in held and (near := did_you_mean(name, held)):
            yield f"{where}: {name!r} is not known here.{near}"


def _algorithms(paper: Paper, registry: Registry) -> Iterator[str]:
    where = f"{paper.folder / 'paper.toml'}: algorithms"
    return _misspelt(where, paper.algorithms, registry.algorithms)


def _surfaces(paper: Paper, registry: Registry) -> Iterator[str]:
    where = f"{paper.folder / 'paper.toml'}: surfaces"
    known = [*registry.surfaces, *registry.datasets]
    return _misspelt(where, paper.surfaces.values(), known)


def _digits(paper: Paper) -> Iterator[str]:
    """Yield the figures that a table would show with fewer digits than are printed."""
    for number, table in paper.printed.items():
        for figure in table.figures:
            most = 0
            for row in paper.tables[number].values():
                for name in paper.algorithms:
                    value = row.get(figure.printed.format(name))
                    if value is not None:
                        exponent = Decimal(repr(round(value, 9))).normalize().as_tuple().exponent
                        most = max(most, -int(exponent))
            if most > figure.digits:
                yield (
                    f"{paper.folder / 'tables.toml'}: table {number}, {figure.column}: cells have "
                    f"{most} digits after the point, and digits = {figure.digits} shows fewer"
                )


def _claim(
    paper: Paper, claim: StatedClaim, functions: Iterable[str], registry: Registry
) -> Iterator[str]:
    where = f"{paper.folder / 'claims.toml'}: claim {claim.name!r}"
    yield from _misspelt(f"{where}: algorithms", claim.algorithms, registry.algorithms)
    columns = {*COLUMNS, *FRAME_COLUMNS, *OF_CLAIMS}
    more = {*KNOWN, *paper.numbers, *functions, *claim.each, *claim.per}
    expressions = {"rows": claim.rows, **claim.each, "of": claim.of, "lacking": claim.lacking}
    expressions |= {"holds": claim.holds}
    texts = {"figures": claim.figures, "none": claim.none, "further": claim.further}
    for field, expression in (*expressions.items(), *texts.items()):
        try:
            names = names_in(expression, text=field in texts)
        except ParameterError as error:
            yield f"{where}: {field}: {error}"
            continue
        for name in names:
            if name not in columns and name not in more and name not in FUNCTIONS:
                yield f"{where}: {field}: {unknown(expression, name, sorted(columns), more)}"

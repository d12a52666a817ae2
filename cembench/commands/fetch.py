"""The verb that fetches surfaces: fetch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import Json, complain, err, out, print_json
from cembench.commands.options import LONGEST, finite

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    from cembench.mesh.datasets import Dataset, Progress


def fetch(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME", help="Which; none: list them all.")
    ] = None,
    *,
    timeout: Annotated[
        float,
        typer.Option(min=0.1, max=LONGEST, callback=finite, help="Seconds a server may be silent."),
    ] = 60.0,
    as_json: Json = False,
) -> None:
    """Fetch public surfaces, check them, and say where they lie.

    Each file is fetched once and kept in the cache ($CEMBENCH_CACHE); its
    SHA-256 must be the known one. $CEMBENCH_DATA_URL points to a mirror.
    `map NAME` and `run --dataset NAME` fetch by themselves.
    """
    from cembench.core.errors import DatasetError
    from cembench.registry import load_registry
    from cembench.report.render.terminal import datasets_table

    registry = load_registry()
    if not names:
        known = list(registry.datasets.values())
        if as_json:
            print_json([_about(dataset) for dataset in known])
            return
        out.print(datasets_table([(d, _about(d)["fetched"]) for d in known]))
        for dataset in known:
            out.print(f"{dataset.name}: {dataset.url}", style="dim", markup=False, soft_wrap=True)
        return
    wanted = [registry.dataset(name) for name in dict.fromkeys(names)]
    found: list[dict[str, Any]] = []
    for dataset in wanted:
        try:
            path = fetched(dataset, timeout=timeout)
        except DatasetError as error:
            found.append(_about(dataset) | {"error": str(error)})
            complain(str(error))
            continue
        found.append(_about(dataset))
        if not as_json:
            out.print(f"{dataset.name}: {path}", markup=False, soft_wrap=True)
    if as_json:
        print_json(found)
    if any("error" in about for about in found):
        raise typer.Exit(1)


def fetched(dataset: Dataset, *, timeout: float = 60.0) -> Path:
    """Where is this dataset's file? Fetched if need be, with a bar on a terminal.

    Raises
    ------
    DatasetError
        As :func:`cembench.mesh.datasets.fetch`.

    """
    from cembench.mesh import datasets

    with _shown(dataset) as progress:
        return datasets.fetch(dataset, timeout=timeout, progress=progress)


def _about(dataset: Dataset) -> dict[str, Any]:
    from cembench.mesh.datasets import is_fetched

    return {
        "name": dataset.name,
        "title": dataset.title,
        "paper_row": dataset.paper_row or None,
        "licence": dataset.licence,
        "url": dataset.url,
        "sha256": dataset.sha256,
        "size": dataset.path.stat().st_size if dataset.path.is_file() else dataset.size,
        "fetched": is_fetched(dataset),
        "path": str(dataset.path),
    }


@dataclass
class _Bar:
    """One line of bars, told of bytes."""

    bars: Bars
    line: TaskID
    total: int = 0

    def update(self, count: int) -> None:
        self.bars.update(self.line, advance=count, total=self.total or None)

    def reset(self) -> None:
        self.bars.reset(self.line)

    def close(self) -> None:
        self.bars.stop_task(self.line)


@contextmanager
def _shown(dataset: Dataset) -> Iterator[Progress | None]:
    """A bar on a terminal; nothing elsewhere."""
    if not err.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, DownloadColumn, TextColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}", markup=False), BarColumn(20), DownloadColumn())
    with Bars(*columns, console=err, transient=True) as bars:
        yield _Bar(bars, bars.add_task(f"fetching {dataset.name}", total=dataset.size))


#: Each verb with the examples that its help shows.
VERBS = ((fetch, "Examples:  cembench fetch  ·  cembench fetch chinese-lion left-hand --json"),)

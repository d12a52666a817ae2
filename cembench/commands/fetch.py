"""The command `fetch`: download public surfaces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.api.settings import LONGEST
from cembench.commands.console import Json, complain, err, out, print_json
from cembench.commands.from_api import finite

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    from cembench.mesh.datasets import Dataset
    from cembench.mesh.download import Progress


def fetch(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME", help="Surfaces to fetch; with none, list them all."),
    ] = None,
    *,
    group: Annotated[
        list[str],
        typer.Option("--group", help="A whole group: paper, disks, holes, closed or stress."),
    ] = [],  # noqa: B006
    have: Annotated[
        list[Path],
        typer.Option(
            "--have", help="A folder with files already downloaded; matching ones are copied."
        ),
    ] = [],  # noqa: B006
    jobs: Annotated[int, typer.Option(min=1, max=16, help="Parallel downloads.")] = 4,
    timeout: Annotated[
        float,
        typer.Option(
            min=0.1,
            max=LONGEST,
            callback=finite,
            help="Seconds to wait for a silent server; a slow one must send 4 KiB a second.",
        ),
    ] = 60.0,
    as_json: Json = False,
) -> None:
    """Fetch public surfaces, check them, and print their paths.

    Each file is fetched once and kept in the cache ($CEMBENCH_CACHE); its SHA-256
    must match. $CEMBENCH_DATA_URL points to a mirror. A failed download does not
    stop the others; run the same command again to resume. `--group ict-face`
    fetches the files of the face model. `map NAME` and `run --dataset NAME` fetch
    what they need.
    """
    from cembench.registry import load_registry
    from cembench.report.listings import datasets_table

    registry = load_registry()
    if not names and not group:
        known = list(registry.datasets.values())
        if as_json:
            print_json([_about(dataset) for dataset in known])
            return
        out.print(datasets_table([(d, _about(d)["fetched"]) for d in known]))
        models = {p.group: len(registry.group(p.group)) for p in registry.parts.values()}
        for name, count in models.items():
            out.print(f"{name}: {count} files of a model, fetched with --group {name}")
        return
    wanted = [registry.dataset(name) for name in dict.fromkeys(names or [])]
    wanted += [one for name in group for one in registry.group(name) if one not in wanted]
    found = _fetch_all(wanted, jobs, timeout, have, quiet=as_json)
    if as_json:
        print_json([found[dataset.name] for dataset in wanted])
    if any("error" in about for about in found.values()):
        raise typer.Exit(1)


def _fetch_all(
    wanted: list[Dataset], jobs: int, timeout: float, have: list[Path], *, quiet: bool
) -> dict[str, dict[str, Any]]:
    """Fetch the datasets with progress; return a summary of each by name."""
    from cembench.mesh import datasets

    missing = {d.path: d for d in wanted if not datasets.is_fetched(d)}
    if len(wanted) > 1 and not quiet:
        err.print(_intent(len({d.path for d in wanted}), list(missing.values())), style="dim")
    found: dict[str, dict[str, Any]] = {}
    with (
        bars(list(missing.values())) as progress,
        closing(
            datasets.fetch_all(wanted, jobs=jobs, timeout=timeout, have=have, progress=progress)
        ) as downloads,
    ):
        for one in downloads:
            found[one.dataset.name] = _about(one.dataset)
            if one.error is not None:
                found[one.dataset.name]["error"] = str(one.error)
                complain(str(one.error))
            elif not quiet:
                only = " (no licence stated: do not redistribute)" if one.dataset.fetch_only else ""
                told = f"{one.dataset.name}: {one.path}{only}"
                out.print(told, markup=False, soft_wrap=True)
    failed = sum("error" in about for about in found.values())
    if len(wanted) > 1 and not quiet:
        err.print(
            f"{len(found) - failed} of {len(wanted)} fetched"
            + (f", {failed} failed; run the same command to try again" * bool(failed))
            + ".",
            style="dim",
        )
    return found


def _intent(count: int, missing: list[Dataset]) -> str:
    """Return a line with the number of files and the bytes still to fetch."""
    from cembench.report.listings import bytes_text

    total = bytes_text(sum(d.size or 0 for d in missing))
    unknown = sum(d.size is None for d in missing)
    more = f", and {unknown} of unknown size" if unknown else ""
    return f"{count} files, {count - len(missing)} already here; to fetch: {total}{more}."


def fetched(dataset: Dataset, *, timeout: float = 60.0, seconds: float = inf) -> Path:
    """Return the file of a dataset, fetched if necessary, with a progress bar on a terminal.

    `timeout` and `seconds` are those of :func:`cembench.mesh.datasets.fetch`.

    Raises
    ------
    DatasetError
        As :func:`cembench.mesh.datasets.fetch`.

    """
    from cembench.mesh import datasets

    with bars([dataset]) as progress:
        datasets.fetch(dataset, timeout=timeout, seconds=seconds, progress=progress(dataset))
    return datasets.surface_file(dataset)


def _about(dataset: Dataset) -> dict[str, Any]:
    from cembench.mesh.datasets import is_fetched

    return {
        "name": dataset.name,
        "title": dataset.title,
        "paper_row": dataset.paper_row or None,
        "group": dataset.group or None,
        "faces": dataset.faces,
        "licence": dataset.licence,
        "fetch_only": dataset.fetch_only,
        "note": dataset.note or None,
        "url": dataset.url,
        "sha256": dataset.sha256,
        "size": dataset.path.stat().st_size if dataset.path.is_file() else dataset.size,
        "fetched": is_fetched(dataset),
        "path": str(dataset.path),
    }


@dataclass
class _Bar:
    """The progress bar of one file."""

    bars: Bars
    line: TaskID
    total: int = 0
    whole: TaskID | None = None

    def update(self, count: int) -> None:
        """Add bytes that have arrived."""
        self.bars.update(self.line, advance=count, total=self.total or None)
        if self.whole is not None:
            self.bars.update(self.whole, advance=count)

    def close(self) -> None:
        """Hide the bar of this file if there are others."""
        self.bars.stop_task(self.line)
        if self.whole is not None:
            self.bars.update(self.line, visible=False)


@contextmanager
def bars(datasets: list[Dataset]) -> Iterator[Callable[[Dataset], Progress | None]]:
    """Yield a function that makes a bar for each file on a terminal, and nothing elsewhere."""
    if not err.is_terminal:
        yield lambda dataset: None
        return
    from rich.progress import BarColumn, DownloadColumn, TextColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}", markup=False), BarColumn(20), DownloadColumn())
    total = sum(d.size or 0 for d in datasets)
    with Bars(*columns, console=err, transient=True) as bars:
        whole = bars.add_task("all files", total=total or None) if len(datasets) > 1 else None

        def bar(dataset: Dataset) -> Progress:
            line = bars.add_task(f"fetching {dataset.name}", total=dataset.size)
            return _Bar(bars, line, whole=whole)

        yield bar


#: Each command with the examples in its help.
VERBS = (
    (
        fetch,
        "Examples:  cembench fetch  ·  cembench fetch --group disks  ·  cembench fetch left-hand",
    ),
)

"""Merge several runs into one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cembench.api.settings import AnyPath
from cembench.core.arguments import checked
from cembench.core.errors import ParameterError
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.results.merging import Conflict


@dataclass(frozen=True)
class MergedRuns:
    """One run of several.

    Parameters
    ----------
    output : Path
        Its folder.
    cells : int
        How many cells it holds.
    environments, machines : list of str
        What they were measured in, and on.
    conflicts : tuple of Conflict
        The cells that several machines measured.

    Examples
    --------
    >>> import cembench
    >>> run = cembench.benchmark(["flat-disk"], ["lscm"], faces=200, rounds=1, output="first")
    >>> cembench.merge(["first"], "all").cells
    1
    """

    output: Path
    cells: int
    environments: list[str]
    machines: list[str]
    conflicts: tuple[Conflict, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data, as ``cembench merge --json`` prints it."""
        return asdict(self) | {"output": str(self.output)}


@checked
def merge(
    runs: Sequence[AnyPath],
    output: AnyPath,
    *,
    overwrite: bool = False,
    verify: bool = False,
    require_signed: AnyPath | None = None,
    reporter: Reporter = SILENT,
) -> MergedRuns:
    """Merge the records and exhibits of several runs into one folder.

    Of a cell measured several times on one machine, one that ended ok counts, and then the latest.
    What several machines measured of one surface is kept apart: one machine's cells are in the run,
    those of the others in its folder ``others``.

    Parameters
    ----------
    runs : sequence of paths
        The runs' folders.
    output : path
        Folder for the merged run.
    overwrite : bool
        Merge into one of the runs themselves.
    verify : bool
        Recompute the figures of all maps, not just of a sample.
    require_signed : path, optional
        Refuse runs not signed by somebody in this file (ssh-keygen: ALLOWED SIGNERS).
    reporter : Reporter
        Receives who signed the runs.

    Returns
    -------
    MergedRuns
        What the merged run holds.

    Raises
    ------
    ParameterError
        `output` is the only run.
    RecordError
        One of the runs does not hold what was written, or is not signed.

    Examples
    --------
    >>> import cembench
    >>> for seed in (1, 2):
    ...     run = cembench.benchmark(
    ...         ["flat-disk"], ["lscm"], faces=200 * seed, rounds=1, output=f"run-{seed}"
    ...     )
    >>> cembench.merge(["run-1", "run-2"], "both").cells
    2
    """
    from cembench.core.overwriting import refuse_inputs
    from cembench.results import merging
    from cembench.results.machines import machine_of
    from cembench.results.signing import signers_of
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    folders, into = [Path(run) for run in runs], Path(output)
    if into.exists() and all(run.exists() and run.samefile(into) for run in folders):
        raise ParameterError(f"{into} is the only run: name another one to merge into it.")
    refuse_inputs(into, folders, force=overwrite)
    signers_of(folders, Path(require_signed) if require_signed else None, reporter)
    held = [into] if (into / "records").is_dir() else []
    for run in (*folders, *held):
        sound_records(Store(run), Depth.everything if verify else Depth.sample)
    store = Store(into)
    joined = merging.merge([Store(run) for run in folders], store)
    used = sorted({record.environment for record in store.records()})
    environments = store.environments()
    machines = sorted({machine_of(environments.get(key, {})) for key in used})
    return MergedRuns(into, joined.cells, used, machines, joined.conflicts)

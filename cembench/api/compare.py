"""Compare two versions of solvers: commits, installed environments, or plug-in files."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cembench.api.settings import AnyPath, Faces, Rounds, Seed, Threads, Timeout
from cembench.core.arguments import checked
from cembench.core.errors import ParameterError
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.api.benchmark import Run
    from cembench.results.regressions import Regression
    from cembench.results.runs_compared import Change, Row
    from cembench.running.surfaces import SurfaceInput

#: Rounds of a comparison: enough for a verdict on one of many surfaces.
USUAL_ROUNDS = 10
#: The usual surfaces, and their number of triangles: a job of a workflow takes about a minute.
USUAL_SURFACES = ("cone", "hemi-ellipsoid", "cylinder-sheet")
USUAL_FACES = 5000

#: What relays need to know of each version, by its label, the earlier one first.
Versions = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class VersionsCompared:
    """Two versions of solvers, compared.

    Parameters
    ----------
    run : Run
        The run that measured both: the algorithms are called ``NAME@VERSION``.
    versions : tuple of str
        What the versions are, the earlier one first.
    cells : tuple of pairs of mappings
        The rows of both versions for each algorithm on each surface.
    changes : tuple of Change
        The seconds compared, those of paired rounds: of each timed cell, and then of each
        algorithm over all surfaces.

    Examples
    --------
    >>> import cembench
    >>> run = cembench.Run("results/run")
    >>> cembench.VersionsCompared(run, ("old", "new"), (), ()).versions
    ('old', 'new')
    """

    run: Run
    versions: tuple[str, str]
    cells: tuple[tuple[Row, Row], ...]
    changes: tuple[Change, ...]

    def regressions(
        self, fail_on: Iterable[str] = ("slower", "worse", "invalid")
    ) -> list[Regression]:
        """Return what became worse.

        Parameters
        ----------
        fail_on : iterable of "slower", "worse" and "invalid"
            What to look for. The verdicts "slower" hold together with 95 %.

        Returns
        -------
        list of Regression
            What became worse: each has a `kind`, an `algorithm`, a `surface` and a `detail`.

        Raises
        ------
        ParameterError
            One of them is unknown.
        RecordError
            There was no valid map before.
        """
        from cembench.results.regressions import regressions

        return regressions(self.cells, self.changes, fail_on)


@checked
def compare_versions(
    before: str | None = None,
    after: str | None = None,
    *,
    algorithms: Sequence[str] = (),
    env: Mapping[str, AnyPath] | None = None,
    plugins: Sequence[str] = (),
    surfaces: Iterable[SurfaceInput] = (),
    sets: Sequence[str] = (),
    limit: int | None = None,
    faces: Faces | None = None,
    rounds: Rounds = USUAL_ROUNDS,
    seed: Seed = 0,
    timeout: Timeout = 600.0,
    threads: Threads = 1,
    output: AnyPath | None = None,
    reporter: Reporter = SILENT,
) -> VersionsCompared:
    """Compare two versions of solvers: whether maps became worse, and which one is faster.

    Each round measures both on the same surfaces, in random order and in fresh processes, each
    version in its environment. The harness is that of this installation for both.

    Parameters
    ----------
    before, after : str, optional
        Two commits of the repository in the current folder, such as HEAD~1 and HEAD, or two
        plug-in files (FILE.py) that declare the same solvers.
    algorithms : sequence of str
        Names of the solvers to compare.
    env : mapping, optional
        Instead of `before` and `after`, two installed environments: NAME=PYTHON, the path of the
        interpreter.
    plugins : sequence of str
        Python files or ``module:name`` that declare the solvers; for commits, files of the
        repository.
    surfaces : iterable of meshes, paths, names or pairs of arrays
        The surfaces (default: cone, hemi-ellipsoid and cylinder-sheet, of 5000 triangles).
    sets : sequence of str
        Many surfaces: quick, standard, paper (the profiles), real-disks, corpus, a folder, ...
    limit : int, optional
        Maximum number of surfaces per set of `sets`.
    faces : int, optional
        Number of triangles of generated surfaces.
    rounds : int
        Number of rounds. Fewer than 10 may not decide between many surfaces.
    seed : int
        Seed of the random order within a round.
    timeout : float
        Time limit of a call, in seconds.
    threads : int
        Threads of the numerical libraries; OpenBLAS keeps one, as its sums depend on the number.
    output : path, optional
        The run's folder. Default in Python: a new temporary folder.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    VersionsCompared
        The comparison; ``.regressions()`` is what became worse.

    Raises
    ------
    ParameterError
        There are not two versions, a commit is unknown, or the current folder is in no repository.
    RegistryError
        An environment does not start, or a version has no such solver.
    MeshError
        A surface is unknown or damaged, or no solver takes it.

    Examples
    --------
    >>> import sys
    >>> import cembench
    >>> same = {"old": sys.executable, "new": sys.executable}
    >>> found = cembench.compare_versions(
    ...     algorithms=["harmonic-circle"], env=same, surfaces=["flat-disk"], faces=120, rounds=1
    ... )
    >>> found.regressions(["worse", "invalid"])
    []
    """
    from cembench.api.benchmark import benchmark
    from cembench.results.profiles import Profile
    from cembench.running.relay import Relay, declared

    if not algorithms:
        raise ParameterError("name the solvers to compare: algorithms='cem'.")
    surfaces = tuple(surfaces)
    if not (surfaces or sets):
        surfaces, faces = USUAL_SURFACES, faces or USUAL_FACES
    profile: Any = next((one for one in sets if one in list(Profile)), None)
    with tempfile.TemporaryDirectory(prefix="cembench-") as place, ExitStack() as stack:
        with reporter.busy("preparing both versions"):
            versions = _versions(before, after, env, plugins, Path(place), stack)
            relays = [
                Relay(f"{name}@{label}", solver=name, **about)
                for name, (label, about) in product(algorithms, versions.items())
            ]
            source = "\n".join(declared(number, one) for number, one in enumerate(relays))
        plugin = Path(place) / "solvers_of_versions.py"
        plugin.write_text(source, encoding="utf-8")
        run = benchmark(
            surfaces,
            [relay.name for relay in relays],
            profile=profile,
            sets=[one for one in sets if one != profile],
            limit=limit,
            faces=faces,
            plugins=[str(plugin)],
            rounds=rounds,
            pairing="separate",
            seed=seed,
            timeout=timeout,
            threads=threads,
            reference=relays[0].name,
            output=output,
            reporter=reporter,
        )
    return _compared(run, algorithms, versions)


def _compared(run: Run, algorithms: Sequence[str], versions: Versions) -> VersionsCompared:
    """Return what the records of a run say of two versions."""
    from cembench.results.columns import row
    from cembench.results.comparison import compare
    from cembench.results.runs_compared import Change
    from cembench.validation.quality import compare_speed

    cells, changes, whole = [], [], []
    for name in algorithms:
        earlier, later = (
            {r.cell.mesh_hash: r for r in run.asked if r.cell.algorithm == f"{name}@{label}"}
            for label in versions
        )
        pairs = [(later[key], earlier[key]) for key in earlier if key in later]
        for lost in (row(earlier[key]) for key in earlier if key not in later):
            why = {"status": "skipped", "cause": "the later version does not take such a surface"}
            cells.append((lost | {"algorithm": name}, lost | {"algorithm": name} | why))
        for records in pairs:
            after, before = (row(record) | {"algorithm": name} for record in records)
            cells.append((before, after))
            if (found := compare(*records)) is not None:
                changes.append(Change(before, after, found))
        if len(pairs) > 1 and (over_all := compare_speed(pairs)) is not None:
            about = {"mesh": "all surfaces", "algorithm": name, "solves": "", "seconds": None}
            whole.append(Change(about, about, over_all))
    before, after = (about["version"] for about in versions.values())
    return VersionsCompared(run, (before, after), tuple(cells), (*changes, *whole))


def _versions(
    before: str | None,
    after: str | None,
    env: Mapping[str, AnyPath] | None,
    plugins: Sequence[str],
    place: Path,
    stack: ExitStack,
) -> Versions:
    """Return the two versions that a user names; what they need is removed with the stack."""
    named = [one for one in (before, after) if one is not None]
    if len(env or named) != 2 or (env and named):
        raise ParameterError(
            "name two versions: two commits (HEAD~1 HEAD), two plug-in files, or two environments "
            "by `env`."
        )
    if env:
        files = tuple(map(_absolute, plugins))
        return {
            label: {"version": f"{label} ({path})", "python": str(path), "plugins": files}
            for label, path in env.items()
        }
    labels, here = ("before", "after"), {"python": sys.executable}
    if all(one.endswith(".py") for one in named):
        return {
            label: here | {"version": one, "plugins": tuple(map(_absolute, (*plugins, one)))}
            for label, one in zip(labels, named, strict=True)
        }
    commits, inside = list(map(_commit, named)), _git("rev-parse", "--show-prefix")
    found: Versions = {}
    for label, ref, commit in zip(labels, named, commits, strict=True):
        folder = str(stack.enter_context(_worktree(commit, place / label)) / inside)
        about = {"version": f"{ref} ({commit[:12]})", "folder": folder, "plugins": tuple(plugins)}
        found[label] = here | about
    return found


def _absolute(plugin: str) -> str:
    return str(Path(plugin).absolute()) if plugin.endswith(".py") else plugin


def _commit(ref: str) -> str:
    """Return the hash of a commit.

    Raises
    ------
    ParameterError
        There is no repository, or no such commit.
    """
    try:
        _git("rev-parse", "--git-dir")
    except (OSError, subprocess.CalledProcessError):
        raise ParameterError(
            f"{ref!r} would be a commit, but the current folder is in no repository of git. Change "
            "to it, or name two plug-in files (FILE.py) or two environments."
        ) from None
    try:
        return _git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{ref}^{{commit}}")
    except subprocess.CalledProcessError:
        raise ParameterError(
            f"the repository in the current folder has no commit {ref!r}; `git log --oneline` "
            "lists them. In a shallow clone, fetch it first."
        ) from None


@contextmanager
def _worktree(commit: str, folder: Path) -> Iterator[Path]:
    """Check a commit out into a folder, for the time of the block."""
    _git("worktree", "add", "--detach", str(folder), commit)
    try:
        yield folder
    finally:
        _git("worktree", "remove", "--force", str(folder))


def _git(*words: str) -> str:
    ended = subprocess.run(["git", *words], capture_output=True, encoding="utf-8", check=True)
    return ended.stdout.strip()

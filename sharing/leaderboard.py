"""The figures of several runs together, by question: angles, seconds at equal angles, success.

Every figure opens a record: a median, the lower of two, its own; a share the first cell that did
not end ok; a count the cell nearest to the best. Angles do not depend on the machine, so those of
all runs stand together; seconds are only ever divided by seconds of the same machine and run.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cembench.core.names import slug
from cembench.report.content.evidence import ANGLE, DISK, Evidence, Variant, difference
from cembench.report.content.standings import title_of
from cembench.report.declarations import filled, parsed, read
from cembench.report.declared import DeclaredTable, aggregate
from cembench.report.document import (
    Column,
    Findings,
    Plain,
    Report,
    Section,
    Table,
    Text,
    Value,
    entry,
    missing,
    words,
)
from cembench.report.given_tables import given_table
from cembench.report.palette import series_styles
from cembench.report.plot_rows import average, front
from cembench.report.plots import Axis, Plot, PlotPanel, Point, through, write_plot
from cembench.results.columns import significant
from cembench.results.comparison import scatters
from cembench.results.machines import machine_of, machine_of_record

if TYPE_CHECKING:
    import pandas as pd

    from cembench.registry import Registry

#: Degrees below which angle errors count as equal: nobody sees them.
UNSEEN = 0.01

#: What an opened record shows.
_SHOWN = (
    *("run", "machine", "mesh", "family", "algorithm", "title", "target", "parameters", "status"),
    *("cause", ANGLE, "angle_error_sd_deg", "conformal_energy", "flipped_triangles", "seconds"),
    *("seconds_low", "seconds_high", "speedup", "iterations", "vertices", "faces", "solves"),
    *("backend", "threads", "mesh_hash", "environment", "started_at", "key", "paper_row"),
)
#: What is read of a row besides.
_READ = ("label", "surface", "main", "ok", "as_good")


@dataclass(frozen=True)
class Entrant:
    """A run that takes part: its name, what it holds, and who signed it."""

    name: str
    evidence: Evidence
    signer: str = ""


def leaderboard(entrants: Sequence[Entrant], command: str, folder: Path | None = None) -> Report:
    """Return the leaderboard of several runs; its plot is drawn into `folder`, if given.

    It opens with a ranked table for each target, and with accuracy against time.
    """
    frame = _frame(entrants)
    valid = frame[frame["ok"] & frame["main"]]
    targets = sorted(valid["target"].unique(), key=lambda target: (target != DISK, target))
    maps = {target: _over_best(valid[valid["target"] == target]) for target in targets}
    ranked = tuple(_ranked(target, rows) for target, rows in maps.items())
    plot = _plot(maps)
    figures = [write_plot(plot, folder)] if plot and folder else []
    question = "Whose maps have the best angles in the least time?"
    cells = Section("cells", "Every cell of every run", (_cells(frame),), page=True)
    page = Text("Every cell of every run, with its record, is on a page of its own:")
    sections = (
        *(Section("time", question, (figure,)) for figure in figures),
        Section("success", "Whose maps are valid?", (_success(frame),)),
        Section("machines", "Machines", (_machines(entrants),)),
        Section("measured", "Every cell", (page,), (cells,)),
    )
    counts = {"runs": "run", "machines": "machine", "surfaces": "mesh_hash"}
    about = [(what, str(frame[name].nunique())) for what, name in counts.items()]
    about.append(("cells", f"{len(frame):,}, {int(frame['ok'].sum()):,} ok"))
    rows = {row["record"]: row for row in frame.to_dict("records")}
    head = Findings((_leader_words(ranked),), tables=ranked, plot=next(iter(figures), None))
    return Report("Leaderboard", command, tuple(about), sections, _shown(rows), head)


shared_table = partial(given_table, package="cembench.sharing")

#: Within each of these, seconds are comparable.
_PLACE = ["run", "machine", "mesh_hash", "solves"]


def _over_best(rows: pd.DataFrame) -> pd.DataFrame:
    """Return maps to one target with their figures over the best ones beside them.

    `error` is the angle error over the least on the surface, once for each algorithm: machines give
    the same map, up to rounding. `time` is over the fastest map of the same place that is about as
    good as the best, and `equal` the same of such maps, where several algorithms have one.
    """
    rows = rows.sort_values([ANGLE, "record"])
    error = rows[ANGLE].clip(lower=UNSEEN)
    error /= error.groupby(rows["mesh_hash"]).transform("min")
    place, good = [rows[name] for name in _PLACE], rows["as_good"] & rows["seconds"].notna()
    time = rows["seconds"] / rows["seconds"].where(good).groupby(place).transform("min")
    rivals = rows["label"].where(good).groupby(place).transform("nunique")
    return rows.assign(
        error=error.mask(rows.duplicated(["label", "mesh_hash"])),
        time=time,
        equal=time.where(good & (rivals > 1)),
    )


def _ranked(target: str, maps: pd.DataFrame) -> Table:
    """Return the algorithms of a target, the smallest angle errors first."""
    declared = Path(__file__).with_suffix(".toml")
    spec = parsed(read(declared), DeclaredTable, declared.name)["ranked"]
    columns = (Column("algorithm", numeric=False), *(one.heading for one in spec.columns))
    rows = [
        (words(str(label)), *(aggregate(one, group) for one in spec.columns))
        for label, group in maps.groupby("label")
    ]
    rows.sort(key=lambda row: (row[1].number or inf, row[0].text))
    known = {"target": title_of(target), "surfaces": maps["mesh_hash"].nunique()}
    title, note = filled(spec.title, known), filled(spec.caption, known)
    return Table(f"ranked-{slug(target)}", title, columns, tuple(rows), notes=(note,))


def _leader_words(ranked: Sequence[Table]) -> tuple[str]:
    """Return who leads for each target on average, in words; intervals are in the tables."""
    parts = [
        f"{table.title.partition(',')[0]}: on average {table.rows[0][0].text} has the smallest "
        f"angle errors of {len(table.rows)} algorithms."
        for table in ranked
        if len(table.rows) > 1
    ]
    return (" ".join(parts) or "No two algorithms map to the same target.",)


def _plot(maps: Mapping[str, pd.DataFrame]) -> Plot | None:
    """Return accuracy against time for each target with several algorithms; None without any."""
    labels = {label for rows in maps.values() for label in rows["label"]}
    styles, panels = series_styles(sorted(labels)), []
    x = Axis("time, times the fastest", log=True)
    y = Axis("angle error, times the least", log=True)
    for target, rows in maps.items():
        errors = rows.groupby(["label", "mesh_hash"])["error"].transform("first")
        timed = rows.assign(error=errors).dropna(subset=["time", "error"])
        groups = dict(list(timed.groupby("label")))
        if len(groups) < 2:
            continue
        clouds = {
            str(label): list(map(Point, group["time"], group["error"], group["surface"]))
            for label, group in groups.items()
        }
        series = [through(n, c, "cloud", styles[n], named=False) for n, c in clouds.items()]
        series += [average(n, c, groups[n]["object"], styles[n]) for n, c in clouds.items()]
        panels.append(PlotPanel(x, y, (*series, front(clouds)), target))
    caption = (
        "Large marks are geometric means over surfaces, with 95 % intervals where they show six "
        "objects; (1, 1) is best in both."
    )
    about = ("Accuracy against time", tuple(panels), caption, "Points for each algorithm.")
    return Plot("leaders", *about) if panels else None


def _frame(entrants: Sequence[Entrant]) -> pd.DataFrame:
    """Return all records of all runs, a row each; `record` is a name that no two of them share."""
    import pandas as pd

    from cembench.registry import load_registry

    registry, frames = load_registry(), []
    pairs = zip(entrants, _apart(entrants), strict=True)
    for number, (entrant, apart) in enumerate(pairs):
        evidence = entrant.evidence
        environments = evidence.store.environments()
        names = [name for name in (*_SHOWN, *_READ) if name in evidence.frame]
        frame = evidence.frame[names]
        records = [evidence.by_key[key] for key in frame["key"]]
        frame = frame.assign(
            run=entrant.name,
            object=frame["family"],
            # What is not repeatable is not called the fastest.
            as_good=frame["as_good"].astype(bool) & ~np.array([*map(scatters, records)], bool),
            label=[apart.get(label, label) for label in frame["label"]],
            record=[f"{number:03d}{key}" for key in frame["key"]],
            machine=[machine_of_record(record, environments) for record in records],
            family=[
                family(record.cell.mesh, record.cell.mesh_hash, record.mesh.origin, registry)
                for record in records
            ],
        )
        frames.append(frame.astype(object))
    whole = pd.concat(frames, ignore_index=True)
    return whole.astype(dict.fromkeys(("ok", "main", "as_good"), bool)).astype(
        dict.fromkeys((ANGLE, "seconds", "faces"), float)
    )


def _apart(entrants: Sequence[Entrant]) -> list[dict[str, str]]:
    """Return for each run new labels of algorithms that only share theirs with those of others.

    Another run has another algorithm of that title, or most runs have other parameters of it.
    """
    mains = [[one for one in entrant.evidence.series if one.main] for entrant in entrants]
    named: defaultdict[str, set[str]] = defaultdict(set)
    chosen: defaultdict[str, Counter[Variant]] = defaultdict(Counter)
    for one in chain.from_iterable(mains):
        named[one.label].add(one.algorithm)
        chosen[one.algorithm][one.variant] += 1
    labels: list[dict[str, str]] = []
    for series in mains:
        labels.append({})
        for one in series:
            ((usual, _),) = chosen[one.algorithm].most_common(1)
            words = [one.algorithm] * (len(named[one.label]) > 1)
            words += [difference(one.variant, usual)] * (one.variant != usual)
            if words:
                labels[-1][one.label] = f"{one.label} ({', '.join(words)})"
    return labels


def family(name: str, mesh_hash: str, origin: str, registry: Registry) -> str:
    """Return the family of a surface: a group of public meshes, models, or generated surfaces."""
    groups = {d.mesh_hash: d.group for d in registry.datasets.values() if d.mesh_hash}
    if origin == "stand-in":
        return "stand-ins"
    if mesh_hash in groups:
        return f"public: {groups[mesh_hash] or 'others'}"
    made = slug(name) in {slug(known) for known in registry.surfaces}
    return "generated" if made else "other"


def _success(frame: pd.DataFrame) -> Table:
    """Count the valid maps by family of surfaces."""
    tried = frame[frame["main"] & (frame["status"] != "skipped")]
    families = sorted(tried["family"].unique())
    lacking = missing("it was not tried on this family")
    rows: list[list[Plain]] = []
    for label, group in tried.groupby("label"):
        shares = {name: _share(some) for name, some in group.groupby("family")}
        rows.append([str(label), *(shares.get(n, lacking) for n in families), _share(group)])
    rows.sort(key=lambda row: (-(row[-1].number or 0.0), row[0]))  # type: ignore[union-attr]
    return shared_table("success-by-family", rows, each={"families": [*families, "all"]})


def _share(cells: pd.DataFrame) -> Value:
    """Return the share of valid maps, which opens the first cell without one, or else the first."""
    first, share = cells.sort_values(["ok", "record"]).iloc[0], 100 * cells["ok"].mean()
    return Value(f"{share:.3g} % of {len(cells)}", share, "surface", str(first["record"]))


def commit_of(environment: Mapping[str, Any]) -> str:
    """Return the commit of an environment, with a plus where files were changed; "" if unknown."""
    git = environment.get("git")
    if not isinstance(git, Mapping) or not git.get("commit"):
        return ""
    return str(git["commit"])[:10] + ("+" if git.get("dirty") else "")


def _machines(entrants: Sequence[Entrant]) -> Table:
    rows: list[list[Plain]] = []
    for number, entrant in enumerate(entrants):
        environments = entrant.evidence.store.environments()
        timed: dict[str, list[tuple[float, str]]] = {}
        for record in entrant.evidence.records:
            key, place = f"{number:03d}{record.cell.key}", timed.setdefault(record.environment, [])
            place += [(r.kernel_seconds, key) for r in record.outcome.rounds if r.kernel_seconds]
        for environment, kernels in timed.items():
            about = environments.get(environment, {})
            seconds, key = sorted(kernels)[(len(kernels) - 1) // 2] if kernels else (None, "")
            kernel = seconds and 1000 * seconds
            timing = entry(kernel, ".3g", "no kernel was timed", origin="surface", record=key)
            machine = (machine_of(about) or "not named", str(about.get("cpu") or "-"))
            software = [str(about.get("cembench") or ""), commit_of(about), entrant.signer]
            rows.append([entrant.name, *machine, about.get("cores"), timing])
            rows[-1] += [one or "-" for one in software]
    return shared_table("machines", rows)


def _cells(frame: pd.DataFrame) -> Table:
    order = ["family", "faces", "mesh", "label", "run"]
    rows: list[list[Plain]] = []
    for row in frame.sort_values(order).to_dict("records"):
        figures = (row[n] if isfinite(row[n]) else None for n in (ANGLE, "seconds"))
        how, lacking = {"origin": "surface", "record": row["record"]}, "it has no such figure"
        rows.append([row["run"], row["machine"] or "not named", row["surface"], row["label"]])
        rows[-1].append(Value(row["status"], record=row["record"]))
        rows[-1] += [entry(figure, significant, lacking, **how) for figure in figures]
    return shared_table("every-cell", rows)


def _shown(rows: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    return {
        key: {k: v for k in _SHOWN if (v := row.get(k)) is not None and v == v}  # NaN is no figure
        for key, row in rows.items()
    }

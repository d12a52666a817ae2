"""The figures of several runs together, by question: angles, seconds at equal angles, success.

Every figure opens a record: a median, the lower of two, its own; a share the first cell that did
not end ok; a count the cell nearest to the best. Angles do not depend on the machine, so those of
all runs stand together; seconds are only ever divided by seconds of the same machine and run.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import exp, inf, log
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any

from cembench.core.names import slug
from cembench.report.content.evidence import ANGLE, DISK, Evidence, Variant, difference
from cembench.report.content.standings import title_of
from cembench.report.declarations import filled, own, parsed
from cembench.report.declared import DeclaredTable, aggregate
from cembench.report.document import (
    Column,
    Figure,
    Findings,
    Gap,
    Item,
    Plain,
    Report,
    Section,
    Table,
    Text,
    Value,
    missing,
)
from cembench.report.palette import series_styles
from cembench.report.plot_rows import average, front
from cembench.report.plots import Axis, Plot, PlotPanel, Point, through, write_plot
from cembench.results.columns import significant
from cembench.results.families import average_interval, family_means
from cembench.results.machines import machine_of, machine_of_record

if TYPE_CHECKING:
    import pandas as pd

    from cembench.registry import Registry

#: Degrees below which angle errors count as equal: nobody sees them; and the share of them.
UNSEEN, NEAR = 0.01, 0.01

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
    angles = tuple(_angles(valid[valid["target"] == target], target) for target in targets)
    plot = _plot(valid, targets)
    figure = write_plot(plot, folder) if plot and folder else None
    ranked = [_ranked(valid[valid["target"] == target], target) for target in targets]
    head = Findings(
        (_leader_words(ranked),), tables=tuple(table for table, _ in ranked), plot=figure
    )
    cells = Section("cells", "Every cell of every run", (_cells(frame),), page=True)
    sections = (
        Section("angles", "Whose maps have the smallest angle errors?", (*angles, *_one(figure))),
        Section("seconds", "Who is fastest at equal angles?", _seconds(valid, targets)),
        Section("success", "Whose maps are valid?", (_success(frame),)),
        Section("machines", "Machines", (_machines(entrants),)),
        Section(
            "measured",
            "Every cell",
            (Text("Every cell of every run, with its record, is on a page of its own:"),),
            (cells,),
        ),
    )
    about = (
        ("runs", str(len(entrants))),
        ("machines", str(frame["machine"].nunique())),
        ("surfaces", str(frame["mesh_hash"].nunique())),
        ("cells", f"{len(frame):,}, {int(frame['ok'].sum()):,} ok"),
    )
    rows = {row["record"]: row for row in frame.to_dict("records")}
    return Report("Leaderboard", command, about, sections, _shown(rows), head)


def _one(figure: Figure | None) -> tuple[Figure, ...]:
    return () if figure is None else (figure,)


def _over_least(rows: pd.DataFrame) -> pd.DataFrame:
    """Return maps to one target with their angle errors over the least on the surface."""
    once = rows[rows[ANGLE].notna()].sort_values([ANGLE, "record"])
    once = once.drop_duplicates(["label", "mesh_hash"])
    least = once.groupby("mesh_hash")[ANGLE].transform("min")
    return once.assign(ratio=once[ANGLE].clip(lower=UNSEEN) / least.clip(lower=UNSEEN))


#: Within each of these, seconds are comparable.
_PLACE = ["run", "machine", "mesh_hash", "solves", "target"]


def _over_fastest(rows: pd.DataFrame) -> pd.DataFrame:
    """Return timed maps with their seconds over the fastest as good ones of the same place."""
    known = rows[rows["seconds"].notna()]
    good = known["seconds"].where(known["as_good"].astype(bool))
    return known.assign(
        ratio=known["seconds"] / good.groupby([known[n] for n in _PLACE]).transform("min")
    )


def _ranked(rows: pd.DataFrame, target: str) -> tuple[Table, list[str]]:
    """Return the algorithms of a target, the smallest angle errors first, and their order."""
    angles, seconds = _over_least(rows), _over_fastest(rows).dropna(subset="ratio")
    means = {label: _average(group) for label, group in angles.groupby("label")}
    order = sorted(means, key=lambda label: (means[label].number or inf, label))
    times = {label: _average(group) for label, group in seconds.groupby("label")}
    entries: list[list[Plain]] = []
    for label in order:
        own = angles[angles["label"] == label]
        best = int((own["ratio"] <= 1 + NEAR).sum())
        counts = Value(f"{best} of {len(own)}", float(best), "derived")
        lacking = missing("not timed beside a map as good as the best")
        entries.append([label, means[label], counts, times.get(label, lacking)])
    columns = [Column("algorithm", numeric=False)]
    columns += [
        Column("angle error over the least"),
        Column("best on"),
        Column("seconds over the fastest"),
    ]
    note = (
        f"Over {angles['mesh_hash'].nunique()} surfaces: geometric means over the objects that "
        "they show, with 95 % intervals where there are six. Best on: within 1 % of the least "
        "error of a surface. Seconds are over those of the fastest map that is about as good as "
        "the best, in the same run on the same machine."
    )
    title = f"{title_of(target)}, ranked by their angle errors"
    return Table.of(f"ranked-{slug(target)}", title, columns, entries, notes=(note,)), order


def _average(rows: pd.DataFrame) -> Value:
    """Return the geometric mean of ratios over objects, with its interval, as an entry."""
    ratios, objects = rows["ratio"].tolist(), rows["object"].tolist()
    mean = exp(fmean(family_means(list(map(log, ratios)), objects)))
    interval = average_interval(ratios, objects)
    text = f"{mean:.2f}" + (f" ({interval.low:.2f} to {interval.high:.2f})" if interval else "")
    ordered = rows.sort_values(["ratio", "record"])
    return Value(text, mean, "derived", str(ordered.iloc[(len(ordered) - 1) // 2]["record"]))


def _leader_words(ranked: Sequence[tuple[Table, list[str]]]) -> tuple[str]:
    """Return who leads for each target, in words."""
    parts = [
        f"{table.title.partition(',')[0]}: {order[0]} has the smallest angle errors of "
        f"{len(order)} algorithms."
        for table, order in ranked
        if len(order) > 1
    ]
    return (" ".join(parts) or "No two algorithms map to the same target.",)


def _plot(valid: pd.DataFrame, targets: Sequence[str]) -> Plot | None:
    """Return accuracy against time for each target with several algorithms; None without any."""
    styles, panels = series_styles(sorted(valid["label"].unique())), []
    for target in targets:
        own = valid[valid["target"] == target]
        errors = _over_least(own).set_index(["label", "mesh_hash"])["ratio"]
        timed = _over_fastest(own).dropna(subset="ratio")
        if timed["label"].nunique() < 2:
            continue
        clouds: dict[str, list[Point]] = {}
        objects: dict[str, list[str]] = {}
        for row in timed.to_dict("records"):
            place = row["label"], row["mesh_hash"]
            if place in errors.index:
                clouds.setdefault(row["label"], []).append(
                    Point(row["ratio"], float(errors[place]), str(row["surface"]))
                )
                objects.setdefault(row["label"], []).append(row["object"])
        series = [through(n, c, "cloud", styles[n], named=False) for n, c in clouds.items()]
        series += [average(n, c, objects[n], styles[n]) for n, c in clouds.items()]
        axes = (
            Axis("time, times the fastest", log=True),
            Axis("angle error, times the least", log=True),
        )
        panels.append(PlotPanel(*axes, (*series, front(clouds)), target))
    caption = (
        "Large marks are geometric means over surfaces, with 95 % intervals where they show six "
        "objects; (1, 1) is best in both."
    )
    title = "Accuracy against time"
    return (
        Plot("leaders", title, tuple(panels), caption, "Points for each algorithm.")
        if panels
        else None
    )


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


def _angles(valid: pd.DataFrame, target: str) -> Item:
    """Compare angle errors with the least on each surface, over all machines."""
    title = f"Mean angle errors, {target}"
    # A row an algorithm and surface: machines give the same map, up to rounding.
    once = _over_least(valid)
    if once.empty:
        return Gap(title, "no valid map has one")
    return _compared("angles", f"angles-{slug(target)}", title, once)


def _seconds(valid: pd.DataFrame, targets: Sequence[str]) -> tuple[Item, ...]:
    """Compare the seconds of maps about as good as the best to their target, within each run."""
    title, tables = "Seconds at equal angles", []
    known = _over_fastest(valid[valid["as_good"]])
    known = known[known.groupby(_PLACE)["label"].transform("nunique") > 1]
    for target in targets:
        own = known[known["target"] == target]
        name = f"seconds-at-equal-angles-{slug(target)}"
        tables += [_compared("seconds", name, f"{title}, {target}", own)] if len(own) else []
    why = "no run has two algorithms with equally good maps of a surface to one target"
    return tuple(tables) or (Gap(title, why),)


def _compared(declared: str, name: str, title: str, rows: pd.DataFrame) -> Table:
    """Return a declared table of algorithms, the least median ratio to the best first."""
    spec = parsed(own("leaderboard.toml"), DeclaredTable, "leaderboard.toml")[declared]
    groups = rows.sort_values(["ratio", "record"]).groupby("label")
    order = groups["ratio"].median().sort_values(kind="stable").index
    columns = [Column("algorithm", numeric=False), *(one.heading for one in spec.columns)]
    cells: list[list[Plain]] = [
        [str(label), *(aggregate(one, groups.get_group(label)) for one in spec.columns)]
        for label in order
    ]
    caption = filled(spec.caption, {"surfaces": rows["mesh_hash"].nunique()})
    return Table.of(name, title, columns, cells, caption=caption)


def _success(frame: pd.DataFrame) -> Table:
    """Count the valid maps by family of surfaces."""
    tried = frame[frame["main"] & (frame["status"] != "skipped")]
    families = sorted(tried["family"].unique())
    rows: list[list[Plain]] = []
    for label, group in tried.groupby("label"):
        cells: list[Plain] = [str(label)]
        for chosen in [*families, None]:
            some = group if chosen is None else group[group["family"] == chosen]
            if some.empty:
                cells.append(missing("it was not tried on this family"))
                continue
            first = some.sort_values(["ok", "record"]).iloc[0]
            share = 100 * some["ok"].mean()
            text = f"{share:.3g} % of {len(some)}"
            cells.append(Value(text, share, "surface", str(first["record"])))
        rows.append(cells)
    rows.sort(key=lambda row: (-(row[-1].number or 0.0), row[0]))  # type: ignore[union-attr]
    return Table.of(
        "success-by-family",
        "Valid maps by family of surfaces",
        [Column("algorithm", numeric=False), *(Column(name) for name in [*families, "all"])],
        rows,
        caption="Shares of the cells that ended with a valid map; each opens the first that did "
        "not, or else the first.",
    )


def _machines(entrants: Sequence[Entrant]) -> Table:
    rows: list[list[Plain]] = []
    for number, entrant in enumerate(entrants):
        environments = entrant.evidence.store.environments()
        timed: dict[str, list[tuple[float, str]]] = {}
        for record in entrant.evidence.records:
            key = f"{number:03d}{record.cell.key}"
            timed.setdefault(record.environment, []).extend(
                (r.kernel_seconds, key) for r in record.outcome.rounds if r.kernel_seconds
            )
        for environment, kernels in timed.items():
            about = environments.get(environment, {})
            git = about.get("git") or {}
            middle = sorted(kernels)[(len(kernels) - 1) // 2] if kernels else None
            rows.append(
                [
                    entrant.name,
                    machine_of(about) or "not named",
                    str(about.get("cpu") or "-"),
                    about.get("cores"),
                    missing("no kernel was timed")
                    if middle is None
                    else Value(f"{1000 * middle[0]:.3g}", 1000 * middle[0], "surface", middle[1]),
                    str(about.get("cembench") or "-"),
                    str(git.get("commit") or "-")[:10] + ("+" if git.get("dirty") else ""),
                    entrant.signer or "-",
                ]
            )
    text = ("run", "machine", "processor")
    return Table.of(
        "machines",
        "Machines and software",
        [
            *(Column(t, numeric=False) for t in text),
            Column("cores", form=",d", lacking="not recorded"),
            Column("kernel", unit="ms"),
            *(Column(t, numeric=False) for t in ("cembench", "commit", "signed by")),
        ],
        rows,
        caption="Kernel: a fixed factorisation that is timed in every round.",
    )


def _cells(frame: pd.DataFrame) -> Table:
    order = ["family", "faces", "mesh", "label", "run"]
    rows = [
        [
            row["run"],
            row["machine"] or "not named",
            row["surface"],
            row["label"],
            Value(row["status"], record=row["record"]),
            *(
                missing("it has no such figure")
                if row[name] is None or row[name] != row[name] or row[name] == inf
                else Value(significant(row[name]), row[name], "surface", row["record"])
                for name in (ANGLE, "seconds")
            ),
        ]
        for row in frame.sort_values(order).to_dict("records")
    ]
    return Table.of(
        "every-cell",
        "Run by run",
        [
            *(Column(t, numeric=False) for t in ("run", "machine", "surface", "algorithm", "how")),
            Column("mean angle error", unit="°"),
            Column("seconds", unit="s"),
        ],
        rows,
        notes=("Seconds of different machines do not compare.",),
    )


def _shown(rows: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    return {
        key: {k: v for k in _SHOWN if (v := row.get(k)) is not None and v == v}  # NaN is no figure
        for key, row in rows.items()
    }

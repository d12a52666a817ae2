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
from math import inf
from typing import TYPE_CHECKING, Any

from cembench.core.names import slug
from cembench.report.content.evidence import ANGLE, DISK, Evidence, Variant, difference
from cembench.report.declarations import filled, own, parsed
from cembench.report.declared import DeclaredTable, aggregate
from cembench.report.document import (
    Column,
    Gap,
    Item,
    Plain,
    Report,
    Section,
    Table,
    Value,
    missing,
)
from cembench.results.columns import significant
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


def leaderboard(entrants: Sequence[Entrant], command: str) -> Report:
    """Return the leaderboard of several runs, with a page for the angles of each target."""
    frame = _frame(entrants)
    valid = frame[frame["ok"] & frame["main"]]
    targets = sorted(valid["target"].unique(), key=lambda target: (target != DISK, target))
    angles = tuple(_angles(valid[valid["target"] == target], target) for target in targets)
    cells = Section("cells", "Every cell of every run", (_cells(frame),), page=True)
    sections = (
        Section("angles", "Whose maps have the smallest angle errors?", angles),
        Section("seconds", "Who is fastest at equal angles?", _seconds(valid, targets)),
        Section("success", "Whose maps are valid?", (_success(frame),)),
        Section("machines", "Machines", (_machines(entrants),)),
        Section("measured", "Every cell", sections=(cells,)),
    )
    about = (
        ("runs", str(len(entrants))),
        ("machines", str(frame["machine"].nunique())),
        ("surfaces", str(frame["mesh_hash"].nunique())),
        ("cells", f"{len(frame):,}, {int(frame['ok'].sum()):,} ok"),
    )
    rows = {row["record"]: row for row in frame.to_dict("records")}
    return Report("Leaderboard", command, about, sections, _shown(rows))


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
    known = valid[valid[ANGLE].notna()]
    title = f"Mean angle errors, {target}"
    if known.empty:
        return Gap(title, "no valid map has one")
    # A row an algorithm and surface: machines give the same map, up to rounding.
    once = known.sort_values([ANGLE, "record"]).drop_duplicates(["label", "mesh_hash"])
    least = once.groupby("mesh_hash")[ANGLE].transform("min")
    once = once.assign(ratio=once[ANGLE].clip(lower=UNSEEN) / least.clip(lower=UNSEEN))
    return _compared("angles", f"angles-{slug(target)}", title, once)


def _seconds(valid: pd.DataFrame, targets: Sequence[str]) -> tuple[Item, ...]:
    """Compare the seconds of maps about as good as the best to their target, within each run."""
    title, tables = "Seconds at equal angles", []
    known = valid[valid["as_good"] & valid["seconds"].notna()]
    place = ["run", "machine", "mesh_hash", "solves", "target"]
    known = known[known.groupby(place)["label"].transform("nunique") > 1]
    known = known.assign(ratio=known["seconds"] / known.groupby(place)["seconds"].transform("min"))
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

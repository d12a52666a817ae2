"""The figures of several runs together, by question: angles, seconds at equal angles, success.

Every figure opens a record: a median, the lower of two, its own; a share the first cell that did
not end ok; a count the cell nearest to the best. Angles do not depend on the machine, so those of
all runs stand together; seconds are only ever divided by seconds of the same machine and run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from cembench.core.names import slug
from cembench.report.content.evidence import ANGLE, DISK, Evidence
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
_UNSEEN = 0.01
#: Within this factor of the least, a figure is the best, too.
_TIE = 1.01


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
        Section("seconds", "Who is fastest at equal angles?", (_seconds(valid),)),
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
    for number, entrant in enumerate(entrants):
        evidence = entrant.evidence
        environments = evidence.store.environments()
        names = [name for name in (*_SHOWN, *_READ) if name in evidence.frame]
        frame = evidence.frame[names]
        records = [evidence.by_key[key] for key in frame["key"]]
        frame = frame.assign(
            run=entrant.name,
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


def family(name: str, mesh_hash: str, origin: str, registry: Registry) -> str:
    """Return the family of a surface: a group of public meshes, models, or generated surfaces."""
    groups = {d.mesh_hash: d.group for d in registry.datasets.values() if d.mesh_hash}
    if origin == "stand-in":
        return "stand-ins"
    if mesh_hash in groups:
        return f"public: {groups[mesh_hash] or 'others'}"
    made = slug(name) in {slug(known) for known in registry.surfaces}
    return "generated" if made else "other"


#: Which row of those in order stands for all: the middle, or the lower of two; the last.
_RANKS: dict[str, Callable[[pd.DataFrame], pd.Series]] = {
    "median": lambda ordered: ordered.iloc[(len(ordered) - 1) // 2],
    "worst": lambda ordered: ordered.iloc[-1],
}


@dataclass(frozen=True)
class _Count:
    """How many rows there are, or values of a column; `ties` counts those as good as the best.

    It opens the row that is nearest to the best.
    """

    title: str
    distinct: str = "record"
    ties: bool = False

    @property
    def column(self) -> Column:
        return Column(self.title)

    def of(self, ordered: pd.DataFrame) -> Value:
        counted = ordered[ordered["ratio"] <= _TIE] if self.ties else ordered
        number = counted[self.distinct].nunique()
        return Value(f"{number:,d}", number, "surface", str(ordered["record"].iloc[0]))


@dataclass(frozen=True)
class _Rank:
    """The median of a figure, or its worst, which opens its record."""

    title: str
    group: str
    figure: str

    @property
    def column(self) -> Column:
        return Column(self.title, self.group)

    def of(self, rows: pd.DataFrame) -> Value:
        row = _RANKS[self.title](rows.sort_values([self.figure, "record"]))
        number = float(row[self.figure])
        return Value(significant(number), number, "surface", str(row["record"]))


def _groups(frame: pd.DataFrame) -> Iterable[tuple[Any, pd.DataFrame]]:
    return frame.groupby("label", sort=True)


def _angles(valid: pd.DataFrame, target: str) -> Item:
    """Compare angle errors with the least on each surface, over all machines."""
    known = valid[valid[ANGLE].notna()]
    title = f"Mean angle errors, {target}"
    if known.empty:
        return Gap(title, "no valid map has one")
    # A row an algorithm and surface: machines give the same map, up to rounding.
    once = known.sort_values([ANGLE, "record"]).drop_duplicates(["label", "mesh_hash"])
    least = once.groupby("mesh_hash")[ANGLE].transform("min")
    once = once.assign(ratio=once[ANGLE].clip(lower=_UNSEEN) / least.clip(lower=_UNSEEN))
    figures: tuple[_Count | _Rank, ...] = (
        *(_Count("surfaces"), _Count("best on", ties=True)),
        *(_Rank(t, "over the least on the surface", "ratio") for t in _RANKS),
        *(_Rank(t, "degrees", ANGLE) for t in _RANKS),
    )
    caption = (
        f"Over {once['mesh_hash'].nunique()} surfaces; an algorithm is compared on those that it "
        "maps. Best: within 1 % of the least angle error. Errors below 0.01 degrees count as that."
    )
    return _compared(f"angles-{slug(target)}", title, once, figures, caption)


def _seconds(valid: pd.DataFrame) -> Item:
    """Compare the seconds of maps about as good as the best, within each run and machine."""
    title = "Seconds at equal angles"
    known = valid[valid["as_good"] & valid["seconds"].notna() & (valid["target"] == DISK)]
    place = ["run", "machine", "mesh_hash", "solves"]
    known = known[known.groupby(place)["label"].transform("nunique") > 1]
    if known.empty:
        return Gap(title, "no run has two algorithms with equally good maps of a surface")
    least = known.groupby(place)["seconds"].transform("min")
    figures: tuple[_Count | _Rank, ...] = (
        *(_Count("surfaces", "mesh_hash"), _Count("machines", "machine"), _Count("cells")),
        _Count("fastest", ties=True),
        *(_Rank(t, "seconds over the fastest", "ratio") for t in _RANKS),
    )
    return _compared(
        "seconds-at-equal-angles",
        title,
        known.assign(ratio=known["seconds"] / least),
        figures,
        "Maps to the disk whose mean angle error is at most 1.25 times the least on the surface, "
        "or 0.25 degrees larger: their seconds over those of the fastest of them, in the same run "
        "on the same machine.",
    )


def _compared(
    key: str, title: str, rows: pd.DataFrame, figures: Sequence[_Count | _Rank], caption: str
) -> Table:
    """Return a table of algorithms, the least median ratio to the best first."""
    groups = [(str(label), own.sort_values(["ratio", "record"])) for label, own in _groups(rows)]
    groups.sort(key=lambda one: (_RANKS["median"](one[1])["ratio"], one[0]))
    columns = [Column("algorithm", numeric=False), *(figure.column for figure in figures)]
    cells: list[list[Plain]] = [
        [label, *(figure.of(own) for figure in figures)] for label, own in groups
    ]
    return Table.of(key, title, columns, cells, caption=caption)


def _success(frame: pd.DataFrame) -> Table:
    """Count the valid maps by family of surfaces."""
    tried = frame[frame["main"] & (frame["status"] != "skipped")]
    families = sorted(tried["family"].unique())
    rows: list[list[Plain]] = []
    for label, own in _groups(tried):
        cells: list[Plain] = [str(label)]
        for chosen in [*families, None]:
            some = own if chosen is None else own[own["family"] == chosen]
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

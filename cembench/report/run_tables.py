"""The tables of the commands that measure: `run`, `show`, `map`, `compare` and `peers`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from cembench.report.content.evidence import Evidence
from cembench.report.declared import declared_table, named
from cembench.report.document import Item, Plain, Section, Table, Text, Value, entry, words
from cembench.report.given_tables import given_table
from cembench.results.columns import against_reference, marks_explained
from cembench.results.comparison import Comparison
from cembench.results.frame import listed
from cembench.results.intervals import Interval
from cembench.results.machines import Marks
from cembench.results.multiple_testing import corrected
from cembench.results.records import DEFAULT_ROUNDS, USUAL_REFERENCES, Cell, Record
from cembench.results.regressions import figures_of
from cembench.results.runs_compared import Change, Row
from cembench.running.estimate import Estimate

#: Maximum number of causes listed.
MAX_CAUSES = 8
FEW_ROUNDS = "too few rounds"
#: The figures of :func:`maps_table`, each before and after.
MAP_FIGURES = ("E_C", "mean angle error", "folds")


def results_table(evidence: Evidence) -> Section:
    """Return a table for each policy, a row for each cell, and what disturbed the measurements."""
    items: list[Item] = []
    for policy in evidence.policies:
        keys = [record.cell.key for record in evidence.records if record.cell.solves == policy]
        table = declared_table(evidence, "results", keys=keys)
        assert table is not None, "a policy has records"
        title = f"solves: {policy}" if len(evidence.policies) > 1 else ""
        # In the order asked for; the status, which is last, has the key.
        rows = tuple(sorted(table.rows, key=lambda row: keys.index(row[-1].record)))
        items.append(replace(table, title=title, rows=rows))
    items += map(Text, evidence.machines.explained())
    noted = [x.neighbours for r in evidence.records for x in r.outcome.rounds if x.neighbours]
    busy = sum(neighbours.busy for neighbours in noted)
    if busy:
        message = f"The machine was busy during {busy} of {len(noted)} processes; close other"
        items.append(Text(f"{message} programs, or add --repeat-busy 2 to `cembench run`."))
    return Section("results", "", tuple(items))


def speedups_table(records: Sequence[Record], reference: str) -> Table | None:
    """Return the speedups of the reference over the others, with their intervals.

    Without enough rounds for an interval, each surface has one row. None if there is nothing to
    compare.
    """
    pairs = zip(records, against_reference(records, reference), strict=True)
    compared = [(record, one) for record, (_, one) in pairs if one is not None]
    if not compared:
        return None
    several = len({record.cell.solves for record, _ in compared}) > 1
    policies = [f" ({record.cell.solves})" if several else "" for record, _ in compared]
    found = [comparison for _, comparison in compared]
    if all(comparison.verdict == FEW_ROUNDS for comparison in found):
        names = list(dict.fromkeys(named(record) for record, _ in compared))
        lines: dict[str, dict[str, float]] = {}
        for (record, comparison), policy in zip(compared, policies, strict=True):
            lines.setdefault(record.cell.mesh + policy, {})[named(record)] = comparison.speedup
        rows = [[mesh, *map(line.get, names)] for mesh, line in lines.items()]
        texts = {"reference": reference, "rounds": DEFAULT_ROUNDS}
        each = {"names": names}
        return given_table("speedups-alone", rows, texts, called="speedups", each=each)
    compared_rows: list[list[Plain]] = [
        [record.cell.mesh, named(record) + policy, one.speedup, _sure(one), one.verdict]
        for (record, _), policy, one in zip(compared, policies, corrected(found), strict=True)
    ]
    notes = _corrected_words(found)
    return given_table("speedups", compared_rows, {"reference": reference}, notes=notes)


def contest_tables(records: Sequence[Record], reference: str) -> list[Table]:
    """Return :func:`speedups_table`, and one for each other target with several algorithms."""
    tables = [speedups_table(records, reference)]
    of_reference = {r.target for r in records if r.cell.algorithm == reference}
    for target in dict.fromkeys(r.target for r in records if r.target not in of_reference):
        own = [record for record in records if record.target == target]
        names = list(dict.fromkeys(record.cell.algorithm for record in own))
        usual = USUAL_REFERENCES.get(target, "")
        tables.append(speedups_table(own, usual if usual in names else names[0]))
    return [table for table in tables if table]


def _sure(one: Comparison) -> Value:
    """Return the interval of a speedup, or why there is none."""
    again = "" if one.verdict == FEW_ROUNDS else "; `run --fresh` measures both again"
    return _interval(one.speedup_interval, " to ", one.verdict + again)


def _interval(interval: Interval | None, to: str, lacking: str = FEW_ROUNDS) -> Value:
    if interval is None:
        return entry(None, "", lacking)
    return words(f"{interval.low:.2f}{to}{interval.high:.2f}")


def _corrected_words(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """Yield a note on the correction of the verdicts, and its effect."""
    tested = [one for one in comparisons if one.interval is not None]
    if len(tested) < 2:
        return
    lost = sum(
        one.verdict != alone.verdict for one, alone in zip(corrected(tested), tested, strict=True)
    )
    more = f" Taken alone, {lost} more would be called different; more rounds would decide."
    yield (
        f"All verdicts together hold with 95 % (Holm, {len(tested)} comparisons); each interval "
        f"holds by itself.{more if lost else ''}"
    )


def changes_table(changes: Sequence[Change], *, paired: bool = False) -> Table:
    """Return the changes from one run to another, as ratios of seconds.

    The ratio is corrected for the drift of the reference kernel, if both runs timed it. With
    `paired`, both were measured in the same rounds.
    """
    drift = () if paired else (_drift_words(changes),)
    comparisons = [change.comparison for change in changes]
    policies = len({change.after["solves"] for change in changes}) > 1
    return given_table(
        "changes",
        [
            [
                *(change.after["mesh"], change.after["algorithm"]),
                *[change.after["solves"]] * policies,
                *(one["seconds"] for one in (change.before, change.after)),
                *(together.ratio, _interval(together.interval, "-"), together.verdict),
            ]
            for change, together in zip(changes, corrected(comparisons), strict=True)
        ],
        each={"policies": ["solves"] * policies},
        notes=(*drift, *_corrected_words(comparisons), *_verdict_words(changes)),
    )


def maps_table(cells: Sequence[tuple[Row, Row]]) -> Table:
    """Return the maps of both versions: their energies, angle errors, folds and statuses."""
    rows: list[list[Plain]] = []
    for before, after in cells:
        old, new = figures_of(before, after), figures_of(after, before)
        figures = [one.get(name) for name in MAP_FIGURES for one in (old, new)]
        ended = [words(one["status"]) for one in (before, after)]
        rows.append([after["mesh"], after["algorithm"], *figures, *ended])
    return given_table("maps", rows)


def _verdict_words(changes: Sequence[Change]) -> list[str]:
    """Return how often two runs agree on cells against their reference, and where they do not."""
    said = [change for change in changes if change.verdicts is not None]
    if not said:
        return []
    same = sum(len(set(change.verdicts or ())) == 1 for change in said)
    flipped = [change.after for change in said if change.flipped]
    either = len(said) - same - len(flipped)
    named = listed(": ", (f"{row['algorithm']} on {row['mesh']}" for row in flipped), between=", ")
    return [
        f"Against {said[0].after['reference']} both runs have the same verdict on {same} of "
        f"{len(said)} cells, at most one of them decides on {either}, and they contradict on "
        f"{len(flipped)}{named}."
    ]


def _drift_words(changes: Sequence[Change]) -> str:
    """Return a note on the machine's drift between two runs, and its correction."""
    known = [change.drift for change in changes if change.drift is not None]
    if not known:
        return (
            "The machine's drift between the runs is unknown: not both runs timed the reference "
            "kernel."
        )
    least, most = f"{min(known):.2f}", f"{max(known):.2f}"
    lost = len(changes) - len(known)
    return (
        "Seconds are divided by those of the reference kernel (rank-sum test, 5 %), which took "
        f"{least}{f' to {most}' if most != least else ''} times as long in the later run."
        f"{f' Not corrected: {lost}.' if lost else ''}"
    )


def plan_table(lines: Sequence[tuple[Cell, int, str, Estimate | None]]) -> Table:
    """Return the plan: cells, triangles, what is recorded already, and the estimated cost."""
    rows: list[list[Plain]] = []
    for cell, faces, state, cost in lines:
        costs = ("-", "-", "-")
        if cost is not None:
            gib = f"{cost.memory_bytes / 2**30:.1f} GiB"
            costs = (f"{cost.call_seconds:.2g} s", f"{cost.seconds:.0f} s", gib)
        rows.append([cell.mesh, cell.algorithm, cell.solves, faces, *costs, state])
    return given_table("plan", rows)


def many_table(evidence: Evidence) -> Table:
    """Return valid maps, angle errors, seconds and commonest faults by algorithm."""
    frame = evidence.frame[["algorithm", "status", "faults"]].explode("faults").dropna()
    causes = frame.value_counts(sort=False).sort_values(ascending=False, kind="stable")
    notes = [
        f"{count:>6}  {name}: {status}, {kind.replace('_', ' ')}"
        for (name, status, kind), count in causes[:MAX_CAUSES].items()
    ]
    if len(causes) > MAX_CAUSES:
        notes.append(f"        and {len(causes) - MAX_CAUSES} other kinds")
    table = declared_table(evidence, "many", notes=notes)
    assert table is not None, "a run has records"
    return table


def machine_lines(marked: Marks) -> list[str]:
    """Say that median seconds are of several machines, if they are."""
    machines = len(marked.letters)
    mixed = f"! median seconds are over surfaces on {machines} machines, which mixes them"
    return [mixed, *marked.explained()] if machines else []


def peers_tables(evidence: Evidence) -> Section:
    """Return a table for each surface and target, sorted by E_C / A."""
    items: list[Item] = []
    for (_, target), group in evidence.frame.groupby(["place", "target"]):
        first = evidence.by_key[group["key"].iloc[0]]
        about = {"surface": first.cell.mesh, "faces": f"{first.mesh.faces:,}", "target": target}
        table = declared_table(evidence, "peers", keys=group["key"], **about)
        items += [table] if table else []
    items.append(
        Text(
            "\nE_C / A is E_C over the image's area; compare it within a target. call: seconds in "
            "the process. wall, start, solve: of an external program's process."
        )
    )
    items += map(Text, marks_explained(list(evidence.records)))
    return Section("peers", "", tuple(items))

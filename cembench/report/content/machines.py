"""On which machines a run was measured, and what does not compare because of it."""

from __future__ import annotations

from cembench.report.content.evidence import Evidence
from cembench.report.document import Column, Item, Plain, Section, Table, Text
from cembench.results.machines import machine_of, software_differences


def machines_section(evidence: Evidence) -> Section | None:
    """A line a machine, and in what their software differs; None where there is one machine."""
    environments = evidence.store.environments()
    marked = evidence.machines
    differing = software_differences(evidence.records, environments)
    if not marked.letters and not differing:
        return None
    items: list[Item] = [Text(words) for words in marked.explained()]
    if marked.letters:
        items.append(
            Text(
                "The letter beside a time names its machine. A surface is measured on one machine "
                "by all algorithms, so rates of speedup, their averages, ranks and profiles are "
                "formed within machines. Plots of seconds, and exponents, run over all of them: "
                "part of what they show is how machines differ."
            )
        )
        items.append(_table(evidence))
    items += [Text(f"Other software than most cells have: {words}.") for words in differing]
    return Section("machines", "Machines", tuple(items))


def _table(evidence: Evidence) -> Table:
    environments = evidence.store.environments()
    rows: list[list[Plain]] = []
    for name, letter in evidence.machines.letters.items():
        own = [record for record in evidence.records if evidence.machines.of(record) == letter]
        about = next(
            (e for r in own if machine_of(e := environments.get(r.environment, {})) == name), {}
        )
        surfaces = len({record.cell.mesh_hash for record in own})
        cpu = str(about.get("cpu") or "-")
        rows.append([letter, name or "not named", cpu, surfaces, len(own)])
    columns = [Column(title, numeric=False) for title in ("mark", "machine", "processor")]
    columns += [Column("surfaces"), Column("cells")]
    return Table.of("machines", "Machines of this run", columns, rows, origin="")

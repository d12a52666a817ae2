"""Records that nobody measured: what a test says of one, beside what is usual."""

from cembench.registry import load_registry
from cembench.results.records import Cell, MeshFacts, Outcome, Record, Round

FACTS = MeshFacts(vertices=3, faces=1, boundary_vertices=3, non_delaunay_share=0)
_PARTS = ("cell", "mesh", "outcome")


def record_of(seconds=(), sittings=None, **cell):
    """A record with a round for each of these seconds; without any, the cell failed."""
    sittings = sittings or ["s"] * len(seconds)
    rounds = tuple(Round(calls=(s,), sitting=w) for s, w in zip(seconds, sittings, strict=True))
    return Record(
        cell=Cell(**{"algorithm": "a", "code_hash": "c", "mesh": "m", "mesh_hash": "h"} | cell),
        title="A",
        target="disk",
        mesh=FACTS,
        outcome=Outcome(status="ok" if rounds else "failed", rounds=rounds),
        environment="e",
        started_at="",
    )


def record_on(surface, algorithm, outcome, **cell):
    """A record of an algorithm, registered or not, on a surface."""
    known = load_registry().algorithms.get(algorithm)
    about = {"title": known.title, "target": known.target} if known else {}
    cell = {"algorithm": algorithm, "mesh": surface.name, "mesh_hash": surface.hash} | cell
    loop = len(surface.loops[0])
    facts = {"vertices": surface.n, "faces": surface.m, "boundary_vertices": loop}
    about |= {"outcome": outcome, "started_at": "2026-01-01T00:00:00+00:00"}
    return changed(record_of(**cell), mesh=facts, **about)


def changed(record, each=None, **fields):
    """A record with other fields.

    Those of its cell, mesh and outcome are mappings; `each` has for fields of its rounds a value a
    round.
    """
    if each:
        values = (dict(zip(each, own, strict=True)) for own in zip(*each.values(), strict=True))
        pairs = zip(record.outcome.rounds, values, strict=True)
        rounds = tuple(one.model_copy(update=own) for one, own in pairs)
        fields["outcome"] = {"rounds": rounds} | fields.get("outcome", {})
    for part in _PARTS:
        if isinstance(fields.get(part), dict):
            fields[part] = getattr(record, part).model_copy(update=fields[part])
    return record.model_copy(update=fields)

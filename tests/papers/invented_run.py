"""Runs made in a moment: real maps of small surfaces, and invented seconds."""

from cembench.results.store import Store
from tests.report import small_run


def write(folder, meshes, seconds, by=None, phases=None):
    """Write a run of these surfaces by the algorithms that `seconds` names.

    `by` names the algorithm whose map a program's cell has, and `phases` those of an algorithm.
    """
    store = Store(folder)
    for mesh in meshes:
        for algorithm, spent in seconds.items():
            outcome, uv = small_run.ok((by or {}).get(algorithm, algorithm), mesh, spent)
            if algorithm in (phases or {}):
                rounds = tuple(
                    one.model_copy(update={"phases": phases[algorithm]}) for one in outcome.rounds
                )
                outcome = outcome.model_copy(update={"rounds": rounds})
            record = small_run.record(algorithm, mesh, "", "reuse", outcome)
            store.save(record, uv, {"id": "machine", "cpu": "x"})
        store.save_mesh(mesh)
    return folder

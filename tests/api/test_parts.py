"""A run may be measured in parts, on machines that know nothing of each other, and merged."""

import pytest

import cembench
from cembench.core.errors import ParameterError
from cembench.results.merging import merge
from cembench.results.store import Store

SURFACES = ("flat-disk", "cone", "spherical-cap")
ALGORITHMS = ("harmonic-circle", "lscm")


def planned(**more):
    surfaces = [cembench.surface(name, 200 + 100 * k) for k, name in enumerate(SURFACES)]
    asked = {"solves": ("reuse", "backslash"), "rounds": 1, "dry_run": True} | more
    return cembench.benchmark(surfaces, ALGORITHMS, **asked)


def labels(run):
    return [task.cell.label for task in run.plan.tasks]


@pytest.mark.parametrize("count", [1, 2, 4, 6])
def test_parts_are_the_plan_and_what_is_compared_stays_together(count):
    parts = [planned(part=f"{number}/{count}") for number in range(1, count + 1)]
    assert [labels(part) for part in parts] == [
        labels(planned(part=f"{number}/{count}")) for number in range(1, count + 1)
    ]
    assert sorted(label for part in parts for label in labels(part)) == sorted(labels(planned()))
    for part in parts:
        compared = {}
        for task in part.plan.tasks:
            key = task.cell.mesh, task.cell.solves
            compared.setdefault(key, []).append(task.cell.algorithm)
        assert set(map(tuple, compared.values())) == {ALGORITHMS}


@pytest.mark.parametrize("part", ["0/2", "3/2", "7/9", "2", "a/b", "1/2/3", "-1/2"])
def test_a_part_that_is_not_there_is_refused(part):
    with pytest.raises(ParameterError, match=r"part=.* is not allowed; write 3/20 .* up to 6"):
        planned(part=part)


def test_merged_parts_are_the_run(tmp_path, one_server):
    for number in (1, 2):
        planned(part=f"{number}/2", dry_run=False, output=tmp_path / str(number))
    assert (
        merge([Store(tmp_path / "1"), Store(tmp_path / "2")], Store(tmp_path / "all")).cells == 12
    )
    whole = planned(dry_run=False, output=tmp_path / "whole").records()

    def maps(records):
        return sorted((one.cell.label, one.outcome.status, one.outcome.uv_hash) for one in records)

    assert maps(Store(tmp_path / "all").records()) == maps(whole)

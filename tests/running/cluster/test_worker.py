"""What a worker tells of the process that measures, and when it lets go of it."""

import itertools
import json
from queue import SimpleQueue

import pytest

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
from cembench.core.errors import ClusterError, MeshError
from cembench.running.cluster import worker
from cembench.running.cluster.units import parcel
from cembench.running.cluster.worker import Measurer, MeasurerGoneError
from cembench.running.local import Options
from tests.running.cluster.test_units import NO_TOKEN, two_surfaces


class Process:
    """Stands for the process that measures."""

    def __init__(self):
        self.stdin, self.killed = self, False

    def write(self, text):
        self.asked = text

    def flush(self):
        pass

    def kill(self):
        self.killed = True

    def wait(self):
        return -9


def measurer(lines):
    found = Measurer.__new__(Measurer)
    found.process = Process()
    found.lines = lines
    return found


def said(*whats):
    lines = SimpleQueue()
    for what in whats:
        lines.put(what and json.dumps({"what": what}))
    return lines


def test_what_happens_soon_after_each_other_is_told_together(monkeypatch):
    monkeypatch.setattr(worker, "TELL_EVERY", 1e9)
    told = []
    asked = measurer(said("began", "starts", "ends", "starts", "ends", "done"))
    assert asked.measure("a key", told.append, lambda: True) == ""
    assert asked.process.asked == "a key\n"
    assert [[event["what"] for event in events] for events in told] == [
        ["began"],
        ["starts", "ends", "starts", "ends"],
    ]


def test_what_a_process_told_before_it_ended_arrives():
    told = []
    with pytest.raises(MeasurerGoneError, match="code -9"):
        measurer(said("starts", None)).measure("a key", told.append, lambda: True)
    assert [event["what"] for events in told for event in events] == ["starts"]


def test_a_process_that_ended_before_it_was_asked_is_told(monkeypatch):
    def broken(text):
        raise BrokenPipeError(32, "Broken pipe")

    asked = measurer(said("done"))
    monkeypatch.setattr(asked.process, "write", broken)
    with pytest.raises(MeasurerGoneError, match="ended before"):
        asked.measure("a key", lambda events: None, lambda: True)


def test_a_unit_that_nobody_waits_for_ends_also_while_much_happens(monkeypatch):
    monkeypatch.setattr(worker, "LOOK_EVERY", 0.0)

    class Endless:
        def get(self, timeout):
            return json.dumps({"what": "starts"})

    wanted = itertools.chain([True, True], itertools.repeat(False))
    asked = measurer(Endless())
    with pytest.raises(ClusterError, match="nobody waits"):
        asked.measure("a key", lambda events: None, lambda: next(wanted))
    assert asked.process.killed


def test_a_surface_whose_data_are_not_on_the_machine_is_sent(monkeypatch):
    (task,) = two_surfaces("reuse")[:1]
    flat = task.mesh.renamed("flat-disk")
    there = parcel([task], NO_TOKEN, Options(), 100).unit
    cell = there.cells[0].model_copy(update={"mesh": flat.name})
    named = there.model_copy(update={"cells": (cell,)})
    V, _ = worker._generated(named)
    assert (V == flat.V).all()

    def not_there(*_):
        raise MeshError("its file is not there")

    monkeypatch.setattr(worker, "generate_surface", not_there)
    assert worker._generated(named) is None

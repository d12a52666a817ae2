"""Fixtures of the tests that read files."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cembench.mesh.formats import isolated
from tests.forked import forked


@pytest.fixture
def forked_readers(monkeypatch):
    """Libraries read in forks of this process: twenty-five interpreters would load them anew."""

    def run(command, check, timeout, **streams):
        assert timeout > 60
        assert set(streams.values()) == {subprocess.DEVNULL}
        assert command[:4] == [sys.executable, "-P", "-m", isolated.__name__]
        with Path(os.devnull).open("r+b") as nowhere:
            code = forked(lambda: isolated._main(*command[4:]), [nowhere] * 3)
        return subprocess.CompletedProcess(command, code)

    monkeypatch.setattr(isolated.subprocess, "run", run)

"""A short campaign, run once for all tests of this folder that look at it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.campaign.hard_meshes import FAMILIES
from tests.campaign.journal import Entry

ROOT = Path(__file__).parents[2]


def run_campaign(out, *arguments):
    command = [sys.executable, "-m", "tests.campaign", "--out", out, "--slots", "1", "--seed", "1"]
    return subprocess.run(
        [*map(str, command), *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def entries_of(out):
    lines = (out / "journal.jsonl").read_text().splitlines()
    return [Entry(**json.loads(line)) for line in lines[1:]]


@pytest.fixture(scope="session")
def short_campaign(tmp_path_factory):
    """The folder of a campaign with 300 files and a mesh of each family."""
    out = tmp_path_factory.mktemp("fuzz")
    done = run_campaign(out, "--files", 300, "--meshes", len(FAMILIES), "--kills", 0)
    assert done.returncode in (0, 1), done.stderr
    return out


@pytest.fixture(scope="session")
def tried(short_campaign):
    """What became of each case."""
    return entries_of(short_campaign)

"""A real Slurm gives what one process gives: see start.sh for how to set one up."""

import json
import os
import shutil
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slurm

pytest.importorskip("dask_jobqueue", reason="the extra [cluster] is not installed")
if shutil.which("sbatch") is None or subprocess.run(["sinfo"], capture_output=True).returncode:
    pytest.skip("no Slurm answers: see tests/slurm/start.sh", allow_module_level=True)

SLURM = "slurm:partition=cpu,cores=2,memory=2GB,machines=1,walltime=00:20:00"


def rows_of(folder, *more):
    command = [
        *(sys.executable, "-m", "cembench.commands.cli", "run", "--profile", "quick"),
        *("--faces", "600", "--rounds", "1", "--json", "-o", str(folder), *more),
    ]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode in (0, 1), run.stderr
    return json.loads(run.stdout)


def test_slurm_finishes_the_quick_profile_with_the_same_maps_and_statuses(tmp_path):
    there = rows_of(tmp_path / "there", "--cluster", SLURM)
    here = rows_of(tmp_path / "here")
    assert len(there) == len(here) == 32

    def told(rows, folder):
        hashes = {
            (record := json.loads(path.read_bytes()))["cell"]["mesh"]
            + record["cell"]["algorithm"]: record["outcome"]["uv_hash"]
            for path in (folder / "records").glob("*.json")
        }
        return {
            (row["mesh"], row["algorithm"], row["status"], hashes[row["mesh"] + row["algorithm"]])
            for row in rows
        }

    assert told(there, tmp_path / "there") == told(here, tmp_path / "here")
    user = os.environ.get("USER", "root")
    queue = subprocess.run(["squeue", "-h", "-n", "cembench", "-u", user], capture_output=True)
    assert queue.stdout == b""  # no job is left

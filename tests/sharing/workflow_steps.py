"""The shell steps of a workflow file or an action, run here as the service would run them."""

import os
import subprocess
import sys
from pathlib import Path

import yaml


def steps_of(file, job=None):
    """The steps of a job, or of an action, by their names."""
    parsed = yaml.safe_load(Path(file).read_text(encoding="utf-8"))
    steps = parsed["jobs"][job]["steps"] if job else parsed["runs"]["steps"]
    return {step["name"]: step for step in steps if "name" in step}


def run_step(step, folder, **environment):
    """Run a shell step in a folder: its exit code, output, and the job's summary."""
    summary = folder / "summary.md"
    summary.touch()
    commands = Path(sys.executable).parent
    known = os.environ | {
        "GITHUB_STEP_SUMMARY": str(summary),
        "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}",
    }
    done = subprocess.run(
        ["bash", "-eo", "pipefail", "-c", step["run"]],
        cwd=folder,
        env=known | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr, summary.read_text()

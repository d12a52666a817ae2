"""The lower bounds that pyproject.toml declares are versions that work."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: What each library is used for, without what takes long.
SUBSET = (
    "tests/test_cli.py",
    "tests/test_bad_input.py",
    "tests/test_store.py",
    "tests/test_verify.py",
    "tests/test_run_verbs.py",
    "tests/test_options.py",
    "tests/geometry/test_files.py",
    "tests/geometry/test_mesh.py",
    "tests/geometry/test_cholesky.py",
    "tests/algorithms/test_closed_form.py",
    "tests/running/test_local.py",
    "tests/reporting/test_export.py",
    "tests/reporting/test_plots.py",
    "tests/reporting/test_preview.py",
    "tests/reporting/test_report.py",
    "tests/morphing/test_writers.py",
)


@pytest.mark.slow
def test_the_lowest_versions_declared_pass_the_tests(tmp_path):
    uv = pytest.importorskip("uv").find_uv_bin()
    source = tmp_path / "source"
    shutil.copytree(
        ROOT,
        source,
        ignore=shutil.ignore_patterns(".git", ".*", "reports", "results", "*.egg-info", "build"),
    )
    clean = {name: value for name, value in os.environ.items() if name != "VIRTUAL_ENV"}

    def run(*command):
        done = subprocess.run(
            command, cwd=source, env=clean, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-4000:]

    python = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(uv, "venv", "--python", sys.executable, str(tmp_path / "venv"))
    lowest = ("--resolution", "lowest-direct", "--editable", ".[render,test]")
    run(uv, "pip", "install", "--quiet", "--python", str(python), *lowest)
    # Old libraries are deprecated by new ones below them; that is no fault of a bound.
    run(str(python), "-m", "pytest", "-q", "-x", "-W", "default", "-m", "not slow", *SUBSET)

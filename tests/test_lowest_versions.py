"""The lower bounds that pyproject.toml declares are versions that work."""

import os
import subprocess
import sys

import pytest

from tests.source_copy import ROOT, copy_source

#: What each library is used for, without what takes long.
SUBSET = (
    "tests/commands/test_cli.py",
    "tests/commands/test_options.py",
    "tests/commands/test_run.py",
    "tests/core/test_extras.py",
    "tests/drawing/test_preview.py",
    "tests/mesh/test_bad_input.py",
    "tests/mesh/test_files.py",
    "tests/mesh/test_triangle_mesh.py",
    "tests/linear_algebra/test_cholesky.py",
    "tests/algorithms/test_closed_form.py",
    "tests/running/test_local.py",
    "tests/report/test_export.py",
    "tests/report/test_plots.py",
    "tests/report/test_report.py",
    "tests/results/test_store.py",
    "tests/results/test_verify.py",
    "tests/morphing/test_writers.py",
)


def test_the_files_named_are_there():
    assert [file for file in SUBSET if not (ROOT / file).is_file()] == []


@pytest.mark.slow
def test_the_lowest_versions_declared_pass_the_tests(tmp_path):
    uv = pytest.importorskip("uv").find_uv_bin()
    source = copy_source(tmp_path / "source")
    clean = {name: value for name, value in os.environ.items() if name != "VIRTUAL_ENV"}

    def run(*command):
        done = subprocess.run(
            command, cwd=source, env=clean, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-4000:]

    python = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(uv, "venv", "--python", sys.executable, str(tmp_path / "venv"))
    lowest = ("--resolution", "lowest-direct", "--editable", ".[all,test]")
    run(uv, "pip", "install", "--quiet", "--python", str(python), *lowest)
    # Old libraries are deprecated by new ones below them; that is no fault of a bound.
    run(str(python), "-m", "pytest", "-q", "-x", "-W", "default", "-m", "not slow", *SUBSET)

"""Run tests under each Python that is installed here, and under the lowest versions declared.

python .ci/test_matrix.py [VERSION ...] [--whole]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import uv

ROOT = Path(__file__).parents[1]
#: Versions that pyproject.toml names, and the lowest libraries on the first.
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
LOWEST = "lowest"
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
    "tests/papers/morphing/test_writers.py",
)


def main() -> None:
    """Run what is here, say what is not, and exit with 1 if something failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("versions", nargs="*", metavar="VERSION", default=[*VERSIONS, LOWEST])
    parser.add_argument("--whole", action="store_true", help="all quick tests, not the subset")
    asked = parser.parse_args()
    if unknown := set(asked.versions) - {*VERSIONS, LOWEST}:
        parser.error(f"unknown: {', '.join(unknown)}; known: {', '.join((*VERSIONS, LOWEST))}")
    found = {}
    for version in asked.versions:
        python = python_of(VERSIONS[0] if version == LOWEST else version)
        found[version] = "NOT CHECKED: it is not installed here"
        if python:
            passed = tests(python, lowest=version == LOWEST, whole=asked.whole)
            found[version] = "passed" if passed else "FAILED"
    print("\n".join(f"Python {v:8} {told}" for v, told in found.items()))
    sys.exit("FAILED" in found.values())


def python_of(version: str) -> str | None:
    """Return the interpreter of a version that is installed; none is fetched."""
    command = (uv.find_uv_bin(), "python", "find", "--no-python-downloads", "--system", version)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return done.stdout.strip()
    # The versions of pyenv are no commands unless one of them is chosen.
    rooms = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    kept = sorted(rooms.glob(f"{version}.*/bin/python{version}"))
    return str(kept[-1]) if kept else None


def tests(python: str, *, lowest: bool, whole: bool) -> bool:
    """Whether the tests pass in an environment of their own."""
    told = subprocess.run((python, "--version"), capture_output=True, text=True, check=True)
    print(f"== {told.stdout.strip()}{', lowest versions' if lowest else ''}", flush=True)
    clean = {k: v for k, v in os.environ.items() if k not in ("VIRTUAL_ENV", "PYTHONPATH")}
    with tempfile.TemporaryDirectory() as folder:
        inside = Path(folder) / ("Scripts" if os.name == "nt" else "bin") / "python"
        resolution = ("--resolution", "lowest-direct") if lowest else ()
        commands = [
            (uv.find_uv_bin(), "venv", "--quiet", "--python", python, "--clear", folder),
            (
                *(uv.find_uv_bin(), "pip", "install", "--quiet", "--python", str(inside)),
                *(*resolution, "--editable", f"{ROOT}[all,test]"),
            ),
            (
                *(str(inside), "-m", "pytest", "-q", "-m", "not slow"),
                # Old libraries are deprecated by new ones below them; that is no fault of a bound.
                *(("-W", "default") if lowest else ()),
                *(() if whole else SUBSET),
            ),
        ]
        return all(
            subprocess.run(command, cwd=ROOT, env=clean, check=False).returncode == 0
            for command in commands
        )


if __name__ == "__main__":
    main()

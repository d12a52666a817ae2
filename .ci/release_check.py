"""Build wheel and sdist, look into them, and try the wheel in an environment of its own.

python .ci/release_check.py [--keep FOLDER]
"""

from __future__ import annotations

import argparse
import email
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

import uv
import yaml
from packaging.metadata import Metadata

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
#: Bytes that they may have at most.
WHEEL_BYTES, SDIST_BYTES = 2_000_000, 3_000_000
#: What the default installation may weigh, in bytes on disk, and how many packages it may be.
BYTES, PACKAGES = 600e6, 37
#: What must not be published.
FOREIGN = (".pyc", ".npz", ".obj", ".ply", ".so", ".orig", ".rej")
#: Tests of the installed package: what needs no file of the repository but these.
TESTS = (
    "tests/algorithms/test_closed_form.py",
    "tests/api/test_api.py",
    "tests/commands/test_cli.py",
    "tests/linear_algebra/test_cholesky.py",
    "tests/mesh/test_files.py",
    "tests/mesh/test_triangle_mesh.py",
    "tests/results/test_store.py",
    "tests/results/test_verify.py",
    "tests/report/test_export.py",
)
#: The extras that they need.
EXTRAS = "fetch,parquet,report,standins,tables"
NEEDED = ("pytest", "hypothesis", "PyYAML", "selenium", "trimesh")
#: The two lines of README, on everything they take, by the default installation.
NOTEBOOK = """
import cembench

disk, ring = cembench.surface("hemi-ellipsoid", 400), cembench.surface("catenoid-ring", 400)
for mesh, algorithm in ((disk, "plane"), (ring, "plane-holes")):
    cembench.write_mesh(f"{mesh.name}.off", mesh)
    for surface in (mesh, (mesh.V, mesh.F), f"{mesh.name}.off"):
        result = cembench.parameterize(surface)
        assert result.ok and result.algorithm.name == algorithm
        assert "data:image/png;base64," in result._repr_html_()
        assert result.plot().get_size_inches()[0] > 5
        assert result.show(f"{mesh.name}.html").stat().st_size > 10_000
        result.save(f"{mesh.name}.obj", overwrite=True)
run = cembench.benchmark([disk], ["lscm"], rounds=1)
assert "lscm" in run._repr_html_()
assert len(run.table()) == 1
assert run.report("report").findings
print(cembench.__file__)
"""


def main() -> None:
    """Run all steps, and exit with what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, help="a folder for wheel and sdist")
    keep = parser.parse_args().keep
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder)
        wheel, sdist = build(built)
        faults = [*texts(), *contents(wheel, sdist), *metadata(wheel)]
        for fault in faults:
            print(f"wrong: {fault}")
        tried = try_out(wheel, built)
        for place in placeholders():
            print(f"to fill before publishing: OWNER in {place}")
        if faults or not tried:
            sys.exit("not ready for a release.")
        if keep:
            keep.mkdir(parents=True, exist_ok=True)
            for file in (wheel, sdist):
                shutil.copy(file, keep)
    print("ready for a release, but for what is to fill.")


def build(folder: Path) -> tuple[Path, Path]:
    """Build both; the wheel from the sdist, as an installer would."""
    run(uv.find_uv_bin(), "build", "--quiet", "--out-dir", str(folder), str(ROOT))
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


def texts() -> list[str]:
    """Return where the version, the licence or the address is told differently."""
    project, faults = PROJECT["project"], []
    codemeta = json.loads((ROOT / "codemeta.json").read_text())
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    told = {
        "version": (codemeta["version"], citation["version"]),
        "address": (codemeta["codeRepository"], citation["repository-code"]),
        "licence": (codemeta["license"].rpartition("/")[2], citation["license"]),
    }
    here = (project["version"], project["urls"]["Repository"], project["license"])
    for (name, others), own in zip(told.items(), here, strict=True):
        for file, other in zip(("codemeta.json", "CITATION.cff"), others, strict=True):
            if other != own:
                faults.append(f"{file} has the {name} {other}, pyproject.toml {own}")
    heads = [line for line in (ROOT / "CHANGELOG.md").read_text().splitlines() if line[:3] == "## "]
    release = project["version"].partition(".dev")[0]
    if heads[0] != "## Unreleased" and release not in heads[0]:
        faults.append(f"CHANGELOG.md begins with {heads[0]!r}, of neither Unreleased nor {release}")
    return faults


def contents(wheel: Path, sdist: Path) -> list[str]:
    """Return what is missing in the files, or does not belong there."""
    with zipfile.ZipFile(wheel) as archive:
        in_wheel = archive.namelist()
    with tarfile.open(sdist) as archive:
        in_sdist = [member.name.partition("/")[2] for member in archive if member.isfile()]
    faults = []
    for file, names, most in ((wheel, in_wheel, WHEEL_BYTES), (sdist, in_sdist, SDIST_BYTES)):
        size = file.stat().st_size
        print(f"{file.name}: {size:,} bytes, {len(names)} files")
        if size > most:
            faults.append(f"{file.name} has {size:,} bytes, of at most {most:,}")
        faults += [f"{file.name} holds {name}" for name in names if name.endswith(FOREIGN)]
    tops = {name.partition("/")[0] for name in in_wheel}
    faults += [f"{wheel.name} has {top}/" for top in tops if not top.startswith("cembench")]
    held = set(in_wheel)
    for package in PROJECT["tool"]["setuptools"]["packages"]:
        if f"{package.replace('.', '/')}/__init__.py" not in held:
            faults.append(f"{wheel.name} lacks the package {package}")
    templates = {f"cembench/report/templates/{p.name}" for p in TEMPLATES.iterdir() if p.is_file()}
    needed = [
        (wheel, {"cembench/py.typed", "cembench/papers/cem/paper.toml", *templates}, held),
        (sdist, {"pyproject.toml", "LICENSE", "README.md"}, set(in_sdist)),
    ]
    for file, names, there in needed:
        faults += [f"{file.name} lacks {name}" for name in sorted(names - there)]
    return faults


TEMPLATES = ROOT / "cembench/report/templates"


def metadata(wheel: Path) -> list[str]:
    """Return what an index would refuse of the wheel's metadata."""
    with zipfile.ZipFile(wheel) as archive:
        name = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        raw = archive.read(name)
    try:
        found = Metadata.from_email(raw, validate=True)
    except ExceptionGroup as errors:
        return [f"metadata: {error}" for error in errors.exceptions]
    faults = []
    if found.description_content_type != "text/markdown" or not found.description:
        faults.append("metadata: the description is not README in Markdown")
    if not email.message_from_bytes(raw).get_all("License-File"):
        faults.append("metadata: no licence file is named")
    return faults


def try_out(wheel: Path, folder: Path) -> bool:
    """Whether the wheel, alone and then with what its tests need, does what it should."""
    environment, away = folder / "venv", folder / "away"
    python = environment / ("Scripts" if os.name == "nt" else "bin") / "python"
    away.mkdir()
    shutil.copytree(ROOT / "tests", away / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", away)  # the settings of pytest
    pip = (uv.find_uv_bin(), "pip")
    install = (*pip, "install", "--quiet", "--python", str(python))
    run(uv.find_uv_bin(), "venv", "--quiet", "--python", sys.executable, str(environment))
    run(*install, "--link-mode", "copy", "--compile-bytecode", str(wheel))
    packages = run(*pip, "list", "--python", str(python), "--format", "freeze").split()
    size = sum(path.lstat().st_blocks * 512 for path in environment.rglob("*"))
    place = run(str(python), "-c", NOTEBOOK, cwd=away).split()[-1]
    if len(packages) > PACKAGES or size > BYTES:
        print(f"wrong: {len(packages)} packages of {size:,} bytes")
        return False
    if not Path(place).is_relative_to(environment):
        print(f"wrong: the package that was tried is {place}")
        return False
    cembench = python.with_name("cembench")
    run(str(cembench), "--version", cwd=away)
    run(str(cembench), "list", "algorithms", cwd=away)
    run(*install, f"{wheel}[{EXTRAS}]", *NEEDED)
    command = (str(python), "-m", "pytest", "-q", "-m", "not slow", "-o", "addopts=", *TESTS)
    return subprocess.run(command, cwd=away, env=clean(), check=False).returncode == 0


def placeholders() -> list[str]:
    """Return the files in which OWNER stands for who will host the project."""
    listed = run("git", "-C", str(ROOT), "grep", "-l", "OWNER/cembench").split()
    return [name for name in listed if not name.startswith((".ci/", "tests/"))]


def clean() -> dict[str, str]:
    """Return an environment that names no other of Python."""
    return {k: v for k, v in os.environ.items() if k not in ("VIRTUAL_ENV", "PYTHONPATH")}


def run(*command: str, cwd: Path = ROOT) -> str:
    """Return what a command prints; exit with it where it fails."""
    done = subprocess.run(
        command, cwd=cwd, env=clean(), capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return done.stdout


if __name__ == "__main__":
    main()

"""What a stranger gets: the wheel, in an environment of its own, away from the checkout."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.source_copy import copy_source

#: What the default installation may weigh, in bytes on disk, and how many packages it may be.
BYTES, PACKAGES = 600e6, 37
#: The two lines of README, on everything they take.
NOTEBOOK = """
import cembench

disk, ring = cembench.surface("hemi-ellipsoid", 400), cembench.surface("catenoid-ring", 400)
for mesh, algorithm in ((disk, "direct-cem"), (ring, "direct-cem-holes")):
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
try:
    run.report()
except cembench.MissingExtra as missing:
    print(missing.extra)
print(cembench.__file__)
"""


def size_of(folder):
    return sum(path.lstat().st_blocks * 512 for path in folder.rglob("*"))


@pytest.mark.slow
def test_the_default_installation_is_light_and_does_what_readme_says(tmp_path):
    uv = pytest.importorskip("uv").find_uv_bin()
    source, away = copy_source(tmp_path / "source"), tmp_path / "away"
    away.mkdir()
    clean = {k: v for k, v in os.environ.items() if k not in ("VIRTUAL_ENV", "PYTHONPATH")}

    def run(*command, cwd=away):
        done = subprocess.run(
            command, cwd=cwd, env=clean, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
        return done.stdout

    environment = tmp_path / "venv"
    python = environment / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(uv, "build", "--wheel", "--out-dir", str(tmp_path), cwd=source)
    (wheel,) = tmp_path.glob("*.whl")
    run(uv, "venv", "--python", sys.executable, str(environment))
    install = ("pip", "install", "--link-mode", "copy", "--compile-bytecode")
    run(uv, *install, "--python", str(python), str(wheel))
    packages = run(uv, "pip", "list", "--python", str(python), "--format", "freeze").split()
    assert len(packages) <= PACKAGES
    assert size_of(environment) < BYTES
    *missing, place = run(str(python), "-c", NOTEBOOK).split()
    assert missing == ["report"]
    assert Path(place).is_relative_to(environment)

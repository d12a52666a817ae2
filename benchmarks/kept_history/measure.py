"""Have asv measure the commits of the kept history: ``make history``.

It writes the surfaces, the same bytes for every commit, and measures the commits of `commits.txt`
that have no figures yet. The machine has a name of its own, not that of the host.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np

from cembench.core.atomic import write, write_text
from cembench.mesh.files import read_mesh
from cembench.registry import load_registry
from cembench.running.environment import for_measuring

HERE = Path(__file__).parent
#: Where `suite/history.py` reads the surfaces.
SURFACES = HERE.parents[1] / ".asv/history/surfaces"
#: Generated surfaces, with boundaries as ragged as those of scans, and their numbers of triangles.
GENERATED = {"spherical-cap": 5_000, "hemi-ellipsoid": 20_000}
JAG = 0.5
#: A scan, if it is at hand.
REAL = "human_face.obj"


def write_surfaces(meshes: Path | None) -> None:
    """Write the arrays of all surfaces, unless they are not those that were measured before."""
    registry = load_registry()
    found = {}
    for name, faces in GENERATED.items():
        family = registry.surface(name)
        found[name] = family.function(**family.arguments({"faces": faces, "jag": JAG}))
    if meshes is not None:
        found[Path(REAL).stem] = read_mesh(meshes / REAL)
    hashes = {name: mesh.hash for name, mesh in found.items()}
    known = HERE / "surfaces.json"
    before = json.loads(known.read_text(encoding="utf-8")) if known.is_file() else hashes
    if different := sorted(set(before.items()) ^ set(hashes.items())):
        sys.exit(f"these are not the surfaces that were measured before: {different}.")
    write_text(known, json.dumps(hashes, indent=1) + "\n")
    SURFACES.mkdir(parents=True, exist_ok=True)
    for name, mesh in found.items():
        write(SURFACES / f"{name}.npz", lambda file, of=mesh: np.savez(file, V=of.V, F=of.F))


def asv(*words: str) -> int:
    """Run a command of asv, in the environment of a measurement; return its exit code."""
    command = [sys.executable, "-m", "asv", *words, "--config", "asv.conf.json"]
    return subprocess.run(command, cwd=HERE, env=for_measuring(1), check=False).returncode


def main() -> None:
    """Measure; asv's exit code 2 says that a commit lacks something that another one has."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machine", default="reference", help="the machine's name, not the host's")
    parser.add_argument("--meshes", type=Path, help=f"the folder with {REAL}")
    parser.add_argument("--commits", type=Path, default=HERE / "commits.txt", help="other commits")
    asked = parser.parse_args()
    write_surfaces(asked.meshes)
    about = {"machine": asked.machine, "os": platform.system(), "arch": platform.machine()}
    about |= {"cpu": "not named", "ram": "not named", "num_cpu": "2"}
    asv("machine", *(word for key, value in about.items() for word in (f"--{key}", value)))
    which = f"HASHFILE:{asked.commits.absolute()}"
    code = asv("run", "--machine", asked.machine, "--skip-existing-commits", which)
    sys.exit(code if code not in (0, 2) else 0)


if __name__ == "__main__":
    main()

"""The process of a version: ``PYTHON -P version_server.py JSON`` maps surfaces on request.

It runs in the version's environment, with the version's modules, and uses nothing of the harness.
The first line that it writes describes the solver. Then each line that it reads names a folder with
V and F; it writes uv there, and answers with a line.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import tomllib
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np


class Packages:
    """Finds the packages that a ``package-dir`` of setuptools places in other folders."""

    def __init__(self, folders: dict[str, Path]) -> None:
        self.folders = folders

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return where such a package is."""
        folder = self.folders.get(name)
        if folder is None:
            return None
        file = folder / "__init__.py"
        return spec_from_file_location(name, file, submodule_search_locations=[str(folder)])


def solver_of(name: str, folder: str, plugins: list[str]) -> Any:
    """Return the algorithm of this name: of the code in a folder, if one is given, or installed."""
    root = Path(folder)
    declared: dict[str, Any] = {}
    if folder and (root / "pyproject.toml").is_file():
        declared = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    places = declared.get("tool", {}).get("setuptools", {}).get("package-dir", {})
    if folder:
        sys.path[:0] = [str(root / places.get("", "src")), folder]
        sys.meta_path.insert(0, Packages({k: root / v for k, v in places.items() if k}))
    groups = declared.get("project", {}).get("entry-points", {})
    own = groups.get("cembench.algorithms", {}) | groups.get("cembench.peers", {})
    if name in own:
        module, _, attribute = own[name].partition(":")
        return getattr(importlib.import_module(module), attribute).__cembench__
    files = [str(root / one) if one.endswith(".py") else one for one in plugins]
    return importlib.import_module("cembench.registry").load_registry(files).algorithm(name)


def mapped(algorithm: Any, folder: Path) -> dict[str, Any]:
    """Map the surface in a folder; return what to answer."""
    V, F = np.load(folder / "V.npy"), np.load(folder / "F.npy")
    kind = algorithm.mesh_type
    try:
        result = algorithm.function(getattr(kind, "trusted", kind)(V, F, "surface"))
        np.save(folder / "uv.npy", result.corners if algorithm.target == "atlas" else result.uv)
    except Exception as error:
        gave_up = isinstance(error, importlib.import_module("cembench").AlgorithmFailed)
        return {"failed": str(error), "error": type(error).__name__, "gave_up": gave_up}
    return {"iterations": getattr(result, "iterations", 0)}


def main(asked: dict[str, Any]) -> None:
    """Describe the solver, and map surfaces until standard input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a solver prints is no answer

    def answer(content: dict[str, Any]) -> None:
        answers.write(json.dumps(content) + "\n")
        answers.flush()

    try:
        algorithm = solver_of(**asked)
    except Exception as error:
        answer({"missing": f"{type(error).__name__}: {error}"})
        return
    takes = algorithm.mesh_type.__name__
    answer({"title": algorithm.title, "target": algorithm.target, "takes": takes})
    for line in sys.stdin:
        answer(mapped(algorithm, Path(line.rstrip("\n"))))


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))

"""What kept reports and tables in pages were made of, and whether that has changed since.

``reports/origins.json`` has for each the commit, the command, its seconds, and hashes of the code
that its figures can depend on: all that its study imports, and everything that is found by entry
points where it uses the registry. Comments, docstrings and blank lines do not count.
"""

from __future__ import annotations

import ast
import hashlib
import io
import json
import subprocess
import tarfile
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import PurePosixPath
from typing import Any

from benchmarks.pages import ROOT
from cembench.core.atomic import write_text

FILE = ROOT / "reports/origins.json"
#: Texts of files by their paths from the root of the repository.
Tree = Mapping[str, str]
#: Where the packages that lie below ``cembench`` once installed are in the repository.
ELSEWHERE = {
    "algorithms": "algorithms",
    "papers": "papers",
    "surfaces": "meshes_gen",
    "sharing": "sharing",
    "textures": "textures",
}
#: Which code is named as what: the first that fits. Other code has no part in figures.
GROUPS = {
    "metrics": ("cembench/conformal/metrics.py", "cembench/conformal/atlas.py"),
    "algorithms": ("algorithms/", "cembench/conformal/", "cembench/linear_algebra/"),
    "meshes": ("cembench/mesh/", "meshes_gen/"),
    "statistics over surfaces": ("cembench/results/families.py",),
    "harness": ("cembench/running/", "cembench/results/"),
    "the study": ("benchmarks/",),
}
#: What a kept report's records depend on: what measures.
MEASURING = "cembench/api/benchmark.py"
#: What computes nothing but what reports are written with, at any time: only studies that import it
#: themselves depend on it.
_OF_REPORTS = "statistics over surfaces"
#: Of whose imports everything is meant that entry points name, or all that the package offers.
_ALL = ("cembench/registry.py", "cembench/__init__.py")

#: Fields of a syntax tree that change nothing: how a name is used, and how a text is written.
_NO_MEANING = ("ctx", "kind", "type_comment")
_IMPORTS = (ast.Import, ast.ImportFrom)
#: What writes pages, or carries, combines and tells results: it makes none. What a paper printed,
#: claims and measured with is data.
_CARRYING = ("exhibits", "frame", "merging", "papers", "power_law")
_NO_FIGURES = (
    *("benchmarks/pages.py", "benchmarks/origins.py"),
    *(f"cembench/results/{name}.py" for name in _CARRYING),
)


def working_tree() -> dict[str, str]:
    """Return the Python files of the repository as they are."""
    rooms = ("cembench", "benchmarks", *ELSEWHERE.values())
    files = (file for room in rooms for file in (ROOT / room).rglob("*.py"))
    return {f.relative_to(ROOT).as_posix(): f.read_text(encoding="utf-8") for f in files}


def tree_at(commit: str) -> dict[str, str]:
    """Return the Python files of a commit; none if the repository does not have it."""
    done = subprocess.run(
        ["git", "-C", str(ROOT), "archive", commit], capture_output=True, check=False
    )
    if done.returncode:
        return {}
    files = {}
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        for member in archive:
            if member.name.endswith(".py") and (file := archive.extractfile(member)):
                files[member.name] = file.read().decode()
    return files


def hashes(tree: Tree, start: str) -> dict[str, str]:
    """Return a hash for each group of the code that a file depends on; none without that file."""
    if start not in tree:
        return {}
    texts: dict[str, list[str]] = {}
    files = _closure(tree, start)
    own = {f for file in files if file.startswith("benchmarks/") for f in _imports(tree, file)}
    for file in sorted(files):
        if file in _NO_FIGURES or (file.startswith(GROUPS[_OF_REPORTS]) and file not in own):
            continue
        group = next((g for g, places in GROUPS.items() if file.startswith(places)), None)
        if group is not None:
            texts.setdefault(group, []).append(f"{file}\n{plain(tree[file])}")
    return {
        group: hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
        for group, parts in texts.items()
    }


@cache
def plain(source: str) -> str:
    """Return what source code does: without comments, docstrings, layout and names of locals.

    Where in a file something is imported does not count either.

    >>> plain("def f(a): b = a; return b") == plain("def f(a): c = a; return c")
    True
    """
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        first = body[0] if isinstance(body, list) and body else None
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
            del body[0]
    imports = (node for node in ast.walk(tree) if isinstance(node, _IMPORTS))
    return repr([sorted(map(ast.unparse, imports)), _canonical(tree, {})])


def _canonical(node: Any, names: Mapping[str, str]) -> Any:
    """Return a syntax tree as tuples, the locals of its functions by numbers.

    Fields that are empty are left out: newer versions of Python add some.
    """
    if isinstance(node, list):
        return [_canonical(one, names) for one in node if not isinstance(one, _IMPORTS)]
    if not isinstance(node, ast.AST):
        return node
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        names = {**names, **_locals(node, len(names))}
    if isinstance(node, ast.Name):
        return ("Name", names.get(node.id, node.id))
    fields = ((name, value) for name, value in ast.iter_fields(node) if name not in _NO_MEANING)
    held = [(name, _canonical(v, names)) for name, v in fields if v is not None and v != []]
    return (type(node).__name__, held)


def _locals(function: ast.FunctionDef | ast.AsyncFunctionDef, known: int) -> dict[str, str]:
    """Return numbers for the names that a function stores; parameters stay what they are called."""
    arguments = {node.arg for node in ast.walk(function) if isinstance(node, ast.arg)}
    outer = (ast.Global, ast.Nonlocal)
    shared = {name for node in ast.walk(function) if isinstance(node, outer) for name in node.names}
    nodes = (node for node in ast.walk(function) if isinstance(node, ast.Name))
    stored = [node for node in nodes if isinstance(node.ctx, ast.Store)]
    stored.sort(key=lambda node: (node.lineno, node.col_offset))
    own = dict.fromkeys(node.id for node in stored if node.id not in arguments | shared)
    return {name: f"local {known + k}" for k, name in enumerate(own)}


def _closure(tree: Tree, start: str) -> set[str]:
    """Return the files that a file imports, and those that these import."""
    reached, left = set(), [start]
    while left:
        file = left.pop()
        if file in reached:
            continue
        reached.add(file)
        left += _imports(tree, file)
        if file in _ALL:
            left += [name for name in tree if name.startswith(tuple(ELSEWHERE.values()))]
        if file == "cembench/__init__.py":
            left += [name for name in tree if name.startswith("cembench/api/")]
    return reached


def _imports(tree: Tree, file: str) -> Iterator[str]:
    package = PurePosixPath(file).parent.parts
    for node in ast.walk(ast.parse(tree[file])):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = list(package[: len(package) - node.level + 1]) if node.level else []
            base = above + (node.module or "").split(".") * bool(node.module)
            names = [[*base, alias.name] for alias in node.names]
        else:
            continue
        for parts in names:
            yield from _files(tree, parts)


def _files(tree: Tree, parts: list[str]) -> Iterable[str]:
    """Return the file of a dotted name, which may be of something in a module."""
    if len(parts) > 1 and parts[0] == "cembench" and parts[1] in ELSEWHERE:
        parts = [ELSEWHERE[parts[1]], *parts[2:]]
    for size in (len(parts), len(parts) - 1):
        path = "/".join(parts[:size])
        # A package's own __init__ counts only where nothing in it is named.
        for file in (f"{path}.py", f"{path}/__init__.py"):
            if file in tree:
                return [file]
    return []


def origins() -> dict[str, dict[str, Any]]:
    """Return what is recorded, by what was made."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def record(made: str, start: str, command: str, seconds: float | None, commit: str = "") -> None:
    """Write down what something was made of: the working tree, or a commit.

    Parameters
    ----------
    made : str
        A kept report's folder, or a page and its study.
    start : str
        The file whose imports its figures depend on.
    command : str
        What makes it.
    seconds : float or None
        How long that took, if it is known.
    commit : str
        The commit it was made at, if not the present one.
    """
    about = {
        "commit": commit or _head(),
        "date": datetime.now(UTC).date().isoformat(),
        "command": command,
        "seconds": None if seconds is None else round(seconds),
        "start": start,
        "hashes": hashes(tree_at(commit) if commit else working_tree(), start),
    }
    write(origins() | {made: about})


def write(known: Mapping[str, Any]) -> None:
    """Write what is recorded, by what was made."""
    write_text(FILE, json.dumps(known, indent=1, sort_keys=True) + "\n")


def changed(about: Mapping[str, Any], now: Tree) -> list[str]:
    """Return which code has changed since something was made; empty if nothing has."""
    then = about["hashes"]
    if not then:
        return ["unknown: made before hashes were recorded"]
    present = hashes(now, about["start"])
    return [group for group in GROUPS if then.get(group) != present.get(group)]


def _head() -> str:
    done = subprocess.run(
        ["git", "-C", str(ROOT), "rev-parse", "--short=12", "HEAD"],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    return done.stdout.strip() or "unknown"

"""Check the installation: libraries, extras, back ends, plug-ins and the machine.

Other packages can add checks through the entry points ``cembench.checks``: functions without
arguments that return an :class:`InstallationFinding`.
"""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points, version

from cembench.core.errors import CembenchError
from cembench.core.extras import Extra, command, missing
from cembench.linear_algebra.backends import available_backends, default_backend
from cembench.mesh.datasets import cache_directory, is_fetched
from cembench.registry import load_registry
from cembench.running.environment import describe_environment

#: The modules of packages that are called otherwise.
_MODULES = {"libigl": "igl"}
_REQUIRED = ("numpy", "scipy", "libigl", "matplotlib", "pandas")
#: Purpose of each extra.
_FOR = {
    Extra.CLUSTER: "measures on several machines",
    Extra.FETCH: "fetches public surfaces",
    Extra.FORMATS: "reads VTK, glTF and GIFTI files, writes geometry images as EXR",
    Extra.METIS: "orders rows by nested dissection: less memory",
    Extra.PARDISO: "adds another linear-algebra back end",
    Extra.PARQUET: "exports runs as Parquet",
    Extra.REPORT: "makes plots of reports interactive",
    Extra.STANDINS: "makes stand-ins for the paper's models",
    Extra.VIDEO: "writes films as MP4",
    Extra.VTP: "reads VTP files",
    Extra.XATLAS: "unwraps surfaces into islands",
}


#: Entry-point group for checks of other packages.
CHECKS = "cembench.checks"


@dataclass(frozen=True)
class InstallationFinding:
    """One line of the check; `remedy` says what to do if it is not ok."""

    name: str
    ok: bool
    detail: str
    required: bool = True
    remedy: str = ""


def doctor() -> list[InstallationFinding]:
    """Check the installation, and say how to install what is missing.

    Returns
    -------
    list of InstallationFinding
        A line for the interpreter, each library, extra and back end, the plug-ins and the machine.

    Examples
    --------
    >>> import cembench
    >>> [one.name for one in cembench.doctor() if one.required and not one.ok]
    []
    """
    return [
        _python(),
        *map(_library, _REQUIRED),
        _backends(),
        _plugins(),
        *(_offered(entry) for entry in sorted(entry_points(group=CHECKS), key=lambda e: e.name)),
        *_datasets(),
        *(_extra(extra) for extra in Extra),
        _machine(),
    ]


def _python() -> InstallationFinding:
    ok, remedy = sys.version_info >= (3, 11), "Install Python 3.11 or newer."
    return InstallationFinding("python", ok, sys.version.split()[0], remedy=remedy)


def _library(package: str) -> InstallationFinding:
    try:
        importlib.import_module(_MODULES.get(package, package))
        return InstallationFinding(package, True, version(package))
    except ImportError as error:
        remedy = f"Run `pip install {package}`."
        return InstallationFinding(package, False, str(error), remedy=remedy)


def _backends() -> InstallationFinding:
    there = available_backends()
    return InstallationFinding(
        "cholesky",
        "cvxopt" in there,
        f"{', '.join(there)} (default {default_backend()}; cvxopt is under the GPL)",
        required=False,
        remedy="Run `pip install cvxopt`; SuperLU, used without it, is several times slower.",
    )


def _plugins() -> InstallationFinding:
    try:
        registry = load_registry()
    except CembenchError as error:
        return InstallationFinding("plug-ins", False, str(error), remedy="See the message.")
    detail = f"{len(registry.algorithms)} algorithms, {len(registry.surfaces)} surfaces"
    held = bool(registry.algorithms)
    return InstallationFinding("plug-ins", held, detail, remedy="Reinstall cembench.")


def _offered(entry: EntryPoint) -> InstallationFinding:
    """Return the finding of another package's check; a check that raises is a failed finding."""
    try:
        names = entry.load()()
    except Exception as error:  # external code may raise anything
        detail = f"{entry.value} failed: {type(error).__name__}: {error}"
        remedy = "Repair or uninstall the package that declares it."
        return InstallationFinding(entry.name, False, detail, required=False, remedy=remedy)
    assert isinstance(names, InstallationFinding)
    return names


def _datasets() -> list[InstallationFinding]:
    try:
        known = load_registry().datasets
    except CembenchError:  # reported in the line of the plug-ins
        return []
    fetched = [name for name, dataset in known.items() if is_fetched(dataset)]
    detail = f"{len(fetched)} of {len(known)} fetched{': ' if fetched else ''}{', '.join(fetched)}"
    detail += f"; kept in {cache_directory()}"
    remedy = "Run `cembench fetch NAME` for the paper's public models; stand-ins need no download."
    all_here = len(fetched) == len(known)
    return [InstallationFinding("datasets", all_here, detail, required=False, remedy=remedy)]


def _extra(extra: Extra) -> InstallationFinding:
    absent = missing(extra)
    detail = _FOR[extra] + (f"; {', '.join(absent)} missing" if absent else "")
    remedy = f"Run `{command(extra)}`."
    return InstallationFinding(f"[{extra}]", not absent, detail, required=False, remedy=remedy)


def _machine() -> InstallationFinding:
    about = describe_environment()
    pages = about["allocator"]["huge_pages"]
    detail = (
        f"{about['cpu']}, {about['hardware_threads']} hardware threads, "
        f"{about['memory_bytes'] / 2**30:.0f} GiB"
        f"{f' (huge pages: {pages})' if pages else ''}; "
        f"{'; '.join(about['blas']) or 'BLAS unknown'}"
    )
    return InstallationFinding("machine", True, detail, required=False)

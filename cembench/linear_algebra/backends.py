"""The libraries that can factor on this machine, found without importing them."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Literal, get_args

from cembench.core.extras import Extra

Backend = Literal["cvxopt", "cvxopt-metis", "superlu", "pardiso"]
_MODULES: dict[Backend, tuple[str, ...]] = {
    "cvxopt": ("cvxopt",),
    "cvxopt-metis": ("cvxopt", "pymetis"),
    "superlu": ("scipy",),
    "pardiso": ("pypardiso",),
}
#: The extras that install back ends.
EXTRAS: dict[str, Extra] = {"cvxopt-metis": Extra.METIS, "pardiso": Extra.PARDISO}


def available_backends() -> list[Backend]:
    """Return the back ends whose libraries are installed."""
    return [name for name in get_args(Backend) if all(map(find_spec, _MODULES[name]))]


def uses_cholmod(backend: Backend) -> bool:
    """Whether a back end factors by CHOLMOD, with one order of the rows or the other."""
    return "cvxopt" in _MODULES[backend]


def default_backend() -> Backend:
    """Return the default back end: cvxopt, or superlu if cvxopt is missing.

    cvxopt is under the GPL; users who must avoid it can uninstall it.
    """
    return "cvxopt" if "cvxopt" in available_backends() else "superlu"

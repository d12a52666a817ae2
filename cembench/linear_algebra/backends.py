"""The libraries that can factor on this machine, found without importing them."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Literal, get_args

Backend = Literal["cvxopt", "superlu", "pardiso"]
_MODULES: dict[Backend, str] = {"cvxopt": "cvxopt", "superlu": "scipy", "pardiso": "pypardiso"}


def available_backends() -> list[Backend]:
    """Return the back ends whose libraries are installed."""
    return [name for name in get_args(Backend) if find_spec(_MODULES[name])]


def default_backend() -> Backend:
    """Return the default back end: cvxopt, or superlu if cvxopt is missing.

    cvxopt is under the GPL; users who must avoid it can uninstall it.
    """
    return "cvxopt" if "cvxopt" in available_backends() else "superlu"

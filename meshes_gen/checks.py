"""Findings about the generators for `cembench doctor`."""

from __future__ import annotations

from cembench.api.doctor import InstallationFinding
from cembench.core.extras import Extra, command

from . import remesh


def remeshing_finding() -> InstallationFinding:
    """Return whether the preferred remeshing filter is available, and how to install it."""
    filter_ = "pymeshlab's filter meshing_isotropic_explicit_remeshing"
    if remesh.has_remeshing_filter():
        return InstallationFinding("remeshing", True, filter_, required=False)
    return InstallationFinding(
        "remeshing",
        False,
        f"{filter_} is missing; surfaces are remeshed by local operations instead, which gives "
        "other meshes",
        required=False,
        remedy=f"Run `{command(Extra.STANDINS)}`, and install the system library libOpenGL "
        "(Debian, Ubuntu: apt-get install libopengl0).",
    )

"""Optional libraries, and the extra of the package that installs each.

The default installation can map, measure and report. Interactive plots, stand-ins, films and the
like need more libraries, which come with extras. They are checked here when they are needed, so
that the error for a missing one names the command that installs it.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from importlib.util import find_spec

from cembench.core.errors import CembenchError


class Extra(StrEnum):
    """An optional set of libraries: ``pip install 'cembench[NAME]'``."""

    CLUSTER = "cluster"
    FETCH = "fetch"
    FORMATS = "formats"
    METIS = "metis"
    PARDISO = "pardiso"
    PARQUET = "parquet"
    REPORT = "report"
    STANDINS = "standins"
    VIDEO = "video"
    VTP = "vtp"
    XATLAS = "xatlas"


#: The modules that each extra installs.
MODULES: Mapping[Extra, tuple[str, ...]] = {
    Extra.CLUSTER: ("cryptography", "dask", "distributed", "dask_jobqueue"),
    Extra.FETCH: ("requests",),
    Extra.FORMATS: ("OpenEXR", "meshio", "nibabel", "trimesh"),
    Extra.METIS: ("pymetis",),
    Extra.PARDISO: ("pypardiso",),
    Extra.PARQUET: ("pyarrow",),
    Extra.REPORT: ("plotly",),
    Extra.STANDINS: ("skimage", "pymeshlab"),
    Extra.VIDEO: ("imageio_ffmpeg",),
    Extra.VTP: ("vtk",),
    Extra.XATLAS: ("xatlas",),
}


class MissingExtra(CembenchError):  # noqa: N818 - what is not there, as the message says
    """An optional library is not installed; `extra` names the extra that installs it.

    Parameters
    ----------
    extra : Extra
        The extra that installs the library.
    purpose : str
        What needs it, as the message begins: "a report".
    missing : sequence of str
        The modules that are not installed.

    Examples
    --------
    >>> from cembench import MissingExtra
    >>> error = MissingExtra(Extra.VIDEO, "a film", ["imageio_ffmpeg"])
    >>> error.extra
    <Extra.VIDEO: 'video'>
    """

    def __init__(self, extra: Extra, purpose: str, missing: list[str]) -> None:
        self.extra = extra
        super().__init__(
            f"{purpose} needs {', '.join(missing)}, which the default installation leaves out; "
            f"run `{command(extra)}`."
        )


def command(extra: Extra) -> str:
    """Return the command that installs an extra.

    >>> command(Extra.VIDEO)
    "pip install 'cembench[video]'"
    """
    return f"pip install 'cembench[{extra}]'"


def missing(extra: Extra, *modules: str) -> list[str]:
    """Return the modules of an extra that are not installed; of all, or of those named."""
    return [name for name in modules or MODULES[extra] if find_spec(name) is None]


def require(extra: Extra, purpose: str, *modules: str) -> None:
    """Check that an extra is installed, before any work is done.

    Parameters
    ----------
    extra : Extra
        The extra that installs the modules.
    purpose : str
        What needs them, as the message begins: "a report".
    *modules : str
        The modules that are needed (default: all of the extra).

    Raises
    ------
    MissingExtra
        A module is not installed.

    Examples
    --------
    >>> require(Extra.VIDEO, "a film", "numpy")
    """
    absent = missing(extra, *modules)
    if absent:
        raise MissingExtra(extra, purpose, absent)

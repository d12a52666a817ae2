"""Libraries that only some uses need: which extra of the package brings each.

The default installation has what mapping, measuring and looking at surfaces need. What reports,
stand-ins, films and the like need beyond it comes with an extra, and is asked for here when it is
needed, so that one that is missing is named with the command that brings it.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from importlib.util import find_spec

from cembench.core.errors import CembenchError


class Extra(StrEnum):
    """What can be installed beside the default: ``pip install 'cembench[NAME]'``."""

    CLUSTER = "cluster"
    FETCH = "fetch"
    FORMATS = "formats"
    PARDISO = "pardiso"
    PARQUET = "parquet"
    REPORT = "report"
    STANDINS = "standins"
    TABLES = "tables"
    VIDEO = "video"
    XATLAS = "xatlas"


#: The modules that each extra brings.
MODULES: Mapping[Extra, tuple[str, ...]] = {
    Extra.CLUSTER: ("dask", "distributed", "dask_jobqueue"),
    Extra.FETCH: ("pooch", "requests"),
    Extra.FORMATS: ("OpenEXR", "meshio", "nibabel", "trimesh"),
    Extra.PARDISO: ("pypardiso",),
    Extra.PARQUET: ("pyarrow",),
    Extra.REPORT: ("jinja2", "markupsafe", "plotly"),
    Extra.STANDINS: ("skimage", "pymeshlab"),
    Extra.TABLES: ("pandas",),
    Extra.VIDEO: ("imageio_ffmpeg",),
    Extra.XATLAS: ("xatlas",),
}


class MissingExtra(CembenchError):  # noqa: N818 - what is not there, as the message says
    """A library is not installed that this use needs; `extra` says which extra brings it."""

    def __init__(self, extra: Extra, purpose: str, missing: list[str]) -> None:
        self.extra = extra
        super().__init__(
            f"{purpose} needs {', '.join(missing)}, which the default installation leaves out; "
            f"run `{command(extra)}`."
        )


def command(extra: Extra) -> str:
    """Return the command that brings an extra.

    >>> command(Extra.VIDEO)
    "pip install 'cembench[video]'"
    """
    return f"pip install 'cembench[{extra}]'"


def missing(extra: Extra, *modules: str) -> list[str]:
    """Return which of an extra's modules are not installed; of all, or of those named."""
    return [name for name in modules or MODULES[extra] if find_spec(name) is None]


def require(extra: Extra, purpose: str, *modules: str) -> None:
    """Check that an extra is installed, before work is done in vain.

    Parameters
    ----------
    extra : Extra
        What brings the modules.
    purpose : str
        What needs them, as the message begins: "a report".
    *modules : str
        Those that are needed, where that is not all of the extra.

    Raises
    ------
    MissingExtra
        One is not installed.

    Examples
    --------
    >>> require(Extra.TABLES, "a table", "numpy")

    """
    absent = missing(extra, *modules)
    if absent:
        raise MissingExtra(extra, purpose, absent)

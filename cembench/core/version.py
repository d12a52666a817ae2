"""The version of the installed package."""

from importlib.metadata import version


def installed_version() -> str:
    """Return the version of cembench that is installed."""
    return version("cembench")

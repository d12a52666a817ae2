"""The versions of installed packages."""

from importlib.metadata import PackageNotFoundError, version


def installed_version() -> str:
    """Return the version of cembench that is installed."""
    return version("cembench")


def version_of(package: str) -> str | None:
    """Return the version of an installed package; None if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None

"""The errors that cembench raises on purpose. All derive from :class:`CembenchError`.

A message names what is wrong, where, what is allowed and what to do. It names arguments as Python
does (``rounds=6``); the command line has an option of the same name (``--rounds 6``).
"""

from __future__ import annotations


class CembenchError(Exception):
    """Base class of all errors whose message is written for the user.

    Examples
    --------
    >>> import cembench
    >>> try:
    ...     cembench.surface("no-such-surface")
    ... except cembench.CembenchError as error:
    ...     print(type(error).__name__)
    RegistryError
    """


class MeshError(CembenchError):
    """A mesh, or the file it is read from, cannot be used.

    Examples
    --------
    >>> import cembench
    >>> cembench.DiskMesh([[0, 0]], [[0, 0, 0]])
    Traceback (most recent call last):
    ...
    cembench.core.errors.MeshError: vertices have shape (1, 2); allowed is (n, 3), a row per vertex.
    """


class RegistryError(CembenchError):
    """An algorithm or surface is unknown, declared twice, or declared wrongly.

    Examples
    --------
    >>> import cembench
    >>> cembench.surface("no-such-surface")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    cembench.core.errors.RegistryError: unknown surface 'no-such-surface'; known: ...
    """


class ParameterError(CembenchError):
    """A parameter has an unknown name or a value outside its range.

    Examples
    --------
    >>> import cembench
    >>> cembench.surface("cone", 600, angle=120)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    cembench.core.errors.ParameterError: cone: angle=120 is not allowed: ... (default 30.0).
    """


class RecordError(CembenchError):
    """A run folder, or a record in it, cannot be read or written.

    Parameters
    ----------
    message : str
        What is wrong and what to do.
    detail : str
        What is wrong, without folders and advice, for a file that somebody else has made (default:
        the message).

    Examples
    --------
    >>> from pathlib import Path
    >>> from cembench.core.loading import read_bytes
    >>> read_bytes(Path("nowhere.json"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    cembench.core.errors.RecordError: 'nowhere.json' cannot be read: ...
    """

    def __init__(self, message: str, detail: str = "") -> None:
        super().__init__(message)
        self.detail = detail or message


class DatasetError(CembenchError):
    """A dataset is unknown, cannot be fetched, or does not match its checksum."""


class AlgorithmFailed(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """An algorithm could not compute a map; the message gives the cause.

    Solvers raise it themselves. The harness records it as the status of that run.

    Examples
    --------
    >>> from cembench import AlgorithmFailed
    >>> raise AlgorithmFailed("the boundary is too crowded")
    Traceback (most recent call last):
    ...
    cembench.core.errors.AlgorithmFailed: the boundary is too crowded
    """


class NotThere(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """A program or library that an algorithm needs is missing; the message says how to get it."""


class NotPositiveDefinite(AlgorithmFailed):
    """A Cholesky factorisation met a pivot that is not positive.

    Examples
    --------
    >>> from scipy import sparse
    >>> from cembench.linear_algebra.cholesky import Cholesky
    >>> Cholesky(-sparse.eye_array(2, format="csc"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    cembench.core.errors.NotPositiveDefinite: the matrix of order 2 is not positive definite ...
    """


class ClusterError(CembenchError):
    """A cluster cannot be reached, is gone, or has machines that cannot measure what is asked."""


class RenderError(CembenchError):
    """A picture cannot be drawn or written.

    Examples
    --------
    >>> import cembench
    >>> result = cembench.parameterize(cembench.surface("flat-disk", 200))
    >>> result.show("nowhere/a.html")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    cembench.core.errors.RenderError: nowhere/a.html cannot be written: ...
    """


#: Longest exception text that is kept, in characters.
LONGEST_MESSAGE = 2_000


def describe_error(error: BaseException) -> str:
    """Return the type and message of an exception, cut to a bounded length."""
    return shortened(f"{type(error).__name__}: {message_of(error)}")


def message_of(error: BaseException) -> str:
    """Return the message of an exception, even if its ``__str__`` raises."""
    try:
        return str(error)
    except BaseException as another:
        return f"(its message cannot be read: {type(another).__name__})"


def shortened(text: str, length: int = LONGEST_MESSAGE) -> str:
    """Return a text of at most `length` characters, cut in the middle, that UTF-8 can encode."""
    if len(text) > length:
        half = (length - 5) // 2
        text = f"{text[:half]} ... {text[-half:]}"
    return text.encode("utf-8", "replace").decode()

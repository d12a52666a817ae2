"""Every error that cembench raises on purpose; all derive from :class:`CembenchError`.

A message says what is wrong, where, what is allowed and what to do about it.
"""


class CembenchError(Exception):
    """Base of all errors whose message is written for the user."""


class MeshError(CembenchError):
    """A mesh, or the file that should hold one, cannot be used."""


class RegistryError(CembenchError):
    """An algorithm or surface is unknown, declared twice, or declared wrongly."""


class ParameterError(CembenchError):
    """A parameter has an unknown name, or a value outside its range."""


class RecordError(CembenchError):
    """A run directory, or a record in it, cannot be read or written."""


class DatasetError(CembenchError):
    """A real mesh is unknown, cannot be fetched, or is not what its checksum says."""


class AlgorithmFailed(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """An algorithm gave up; the message is the cause."""


class NotThere(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """What an algorithm needs is not on this machine; the message says what, and what brings it."""


class NotPositiveDefinite(AlgorithmFailed):
    """A Cholesky factorisation met a pivot that is not positive."""


class ClusterError(CembenchError):
    """A cluster cannot be reached, is gone, or has machines that cannot measure what is asked."""


class RenderError(CembenchError):
    """A picture cannot be drawn or written."""


#: The longest text that is kept of an exception, in characters.
LONGEST_MESSAGE = 2_000


def said_by(error: BaseException) -> str:
    """Return an exception's type and message, of bounded length."""
    return shortened(f"{type(error).__name__}: {message_of(error)}")


def message_of(error: BaseException) -> str:
    """Return the message of an exception, even of one that cannot say it."""
    try:
        return str(error)
    except BaseException as another:
        return f"(its message cannot be read: {type(another).__name__})"


def shortened(text: str, length: int = LONGEST_MESSAGE) -> str:
    """Return a text of at most this length, cut in the middle, without what UTF-8 cannot hold."""
    if len(text) > length:
        half = (length - 5) // 2
        text = f"{text[:half]} ... {text[-half:]}"
    return text.encode("utf-8", "replace").decode()

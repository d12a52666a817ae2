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


class NotPositiveDefinite(AlgorithmFailed):
    """A Cholesky factorisation met a pivot that is not positive."""


class RenderError(CembenchError):
    """A picture cannot be drawn or written."""

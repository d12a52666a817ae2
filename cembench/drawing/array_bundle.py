"""Arrays on their way to a renderer in another process."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Self

import numpy as np


class ArrayBundle:
    """A dataclass whose fields are all arrays: it can be written to a file and read again."""

    def save(self, path: Path) -> None:
        """Write to an ``.npz`` file."""
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read what :meth:`save` wrote."""
        with np.load(path) as arrays:
            return cls(**{field.name: arrays[field.name] for field in fields(cls)})  # type: ignore[arg-type]

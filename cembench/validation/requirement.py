"""The values of ``--require``, in their own module so that the command line loads quickly."""

from __future__ import annotations

from enum import StrEnum


class Requirement(StrEnum):
    """Requirements that ``--require`` can add to validity, for every baseline."""

    faster = "faster"
    not_slower = "not-slower"
    better = "better"
    not_worse = "not-worse"
    no_folds = "no-folds"

"""A plug-in with every installed algorithm once more, under the name NAME-twin.

What is measured of an algorithm and of its twin can differ by chance only: an "A/A" comparison.
"""

from __future__ import annotations

import functools
from typing import Any

from cembench.registry import Algorithm, algorithm, load_registry


def twin(of: Algorithm) -> Any:
    """The same function, declared under another name."""

    @functools.wraps(of.function)
    def again(*arguments: Any, **parameters: Any) -> Any:
        return of.function(*arguments, **parameters)

    again.__module__ = __name__  # it is declared here
    declare = algorithm(f"{of.name}-twin", title=f"{of.title} (twin)", target=of.target)
    return declare(again)


for _installed in load_registry().algorithms.values():
    globals()[f"{_installed.name}-twin"] = twin(_installed)

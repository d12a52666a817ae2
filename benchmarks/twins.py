"""A plug-in with every installed algorithm once more, under the name NAME-twin.

What is measured of an algorithm and of its twin can differ by chance only: an "A/A" comparison.
"""

from __future__ import annotations

import functools
from importlib.metadata import entry_points
from typing import Any

from cembench.registry import Algorithm, algorithm, load_algorithm


def twin(of: Algorithm) -> Any:
    """The same function, declared under another name."""

    @functools.wraps(of.function)
    def again(*arguments: Any, **parameters: Any) -> Any:
        return of.function(*arguments, **parameters)

    again.__module__ = __name__  # it is declared here
    declare = algorithm(f"{of.name}-twin", title=f"{of.title} (twin)", target=of.target)
    return declare(again)


for _name in entry_points(group="cembench.algorithms").names:
    globals()[f"{_name}-twin"] = twin(load_algorithm(_name))

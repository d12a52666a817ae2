"""cembench: benchmarking and reproducibility suite for conformal surface parameterization.

Map a surface and look at the result::

    import cembench

    result = cembench.parameterize("face.obj")
    result.uv, result.metrics, result.save("face_uv.obj")

Names are loaded when they are first used, so that importing the package costs little.
"""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path
from typing import Any

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
#: Where each public name lies, by the imports of `__init__.pyi`.
_PLACE_OF = {name: place for place, name in re.findall(r"(?m)^from (\S+) import (\w+) as", _STUB)}

__all__ = sorted((*_PLACE_OF, "__version__"))


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from cembench.core.version import installed_version

        return installed_version()
    place = _PLACE_OF.get(name) or _brought().get(name)
    if place is None:
        module = sys.modules[__name__]  # by which Python suggests what was meant
        raise AttributeError(f"module 'cembench' has no attribute {name!r}", name=name, obj=module)
    value = getattr(importlib.import_module(place), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_brought()})


def _brought() -> dict[str, str]:
    """Return the modules of the names that come with verbs, by entry points."""
    from importlib.metadata import entry_points

    places = [entry.module for entry in entry_points(group="cembench.verbs")]
    return {name: place for place in places for name in importlib.import_module(place).__all__}

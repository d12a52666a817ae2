"""Find the pictures of an example: figures that it has by name, without pyplot."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst


def figures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save each figure that is new since the last block, and return the text that shows it.

    :meth:`cembench.Result.plot` returns a figure that pyplot does not know, as is right in a
    library; sphinx-gallery's own scraper sees pyplot's alone.
    """
    names = block_vars["example_globals"]
    drawn = names.setdefault("__drawn__", [])
    paths = []
    for value in list(names.values()):
        known = any(value is one for one in drawn)
        if not isinstance(value, Figure) or value.canvas.manager is not None or known:
            continue
        drawn.append(value)
        path = next(block_vars["image_path_iterator"])
        value.savefig(path, dpi=100)
        paths.append(path)
    return figure_rst(paths, gallery_conf["src_dir"])

"""A self-contained page with a 3-D view of one surface and its map."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path

from cembench.core.atomic import write_bytes
from cembench.core.errors import RenderError


def view_page(title: str, scene: bytes, picture: bytes, facts: Sequence[tuple[str, str]]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    title : str
        The page's heading.
    scene : bytes
        Scene packed by :func:`cembench.drawing.view_scene.view_scene`.
    picture : bytes
        A PNG file, for browsers without WebGL.
    facts : sequence of pairs of str
        Names and texts shown below.
    """
    from markupsafe import Markup

    from cembench.report.render.html import as_text, environment, policy, template_text

    script = template_text("unpack.js") + template_text("view.js")
    page: str = (
        environment()
        .get_template("view.html")
        .render(
            title=title,
            scene=as_text(scene),
            picture=base64.b64encode(picture).decode(),
            facts=facts,
            style=Markup(template_text("view.css")),
            script=Markup(script),
            policy=policy([script.encode()]),
        )
    )
    return page


def write_view_page(path: Path, page: str) -> None:
    """Write a page.

    Raises
    ------
    RenderError
        The page cannot be written.
    """
    write_bytes(path, page.encode(errors="backslashreplace"), error=RenderError, parents=False)

"""One surface and its map to be turned, as a page that needs nothing beside it."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from cembench.core.atomic import write_bytes
from cembench.core.errors import RenderError
from cembench.report.render.html import environment, policy, template_text


def view_page(title: str, scene: bytes, picture: bytes, facts: Sequence[tuple[str, str]]) -> str:
    """Compose the page.

    Parameters
    ----------
    title : str
        The page's heading.
    scene : bytes
        What :func:`cembench.drawing.view_scene.view_scene` packed.
    picture : bytes
        A PNG file, for browsers without WebGL.
    facts : sequence of pairs of str
        What stands below: names and words.

    """
    script = template_text("view.js")
    page: str = (
        environment()
        .get_template("view.html")
        .render(
            title=title,
            scene=base64.b64encode(scene).decode(),
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
        It cannot be written.

    """
    write_bytes(path, page.encode(errors="backslashreplace"), error=RenderError, parents=False)

"""Recognise pictures that cembench made and may replace."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from cembench.core.errors import RenderError

#: The software named in the metadata of our pictures.
SOFTWARE = "cembench"


def check_replaceable(path: Path) -> None:
    """Raise :class:`RenderError` if a path exists and is not one of our pictures."""
    if not path.exists() and not path.is_symlink():
        return
    try:
        with Image.open(path) as picture:
            maker = picture.info.get("Software")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        maker = None  # not a readable picture
    if path.is_symlink() or maker != SOFTWARE:
        raise RenderError(
            f"{path} already exists and is not a picture that this version of cembench made. Move "
            "it away, name another output with `output`, or add `overwrite` to replace it."
        )

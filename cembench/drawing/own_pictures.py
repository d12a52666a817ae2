"""Which pictures cembench made itself, and so may replace."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from cembench.core.errors import RenderError

#: What our pictures that stand alone say made them.
SOFTWARE = "cembench"


def check_replaceable(path: Path) -> None:
    """Raise :class:`RenderError` where something is at a path that is not a picture of ours."""
    if not path.exists() and not path.is_symlink():
        return
    try:
        with Image.open(path) as picture:
            maker = picture.info.get("Software")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        maker = None  # not a picture at all
    if path.is_symlink() or maker != SOFTWARE:
        raise RenderError(
            f"{path} is there, and is not a picture that this version of cembench made. Move it "
            "away, name another output with -o, or add --force to write over it."
        )

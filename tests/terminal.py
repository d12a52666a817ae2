"""What a terminal of some width shows."""

import io

from rich.console import Console


def printed(thing, width=80):
    """The text of something that rich draws."""
    console = Console(width=width, file=io.StringIO())
    console.print(thing)
    return console.file.getvalue()

"""The contact sheet of the stand-ins."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from cembench.surfaces import contact_sheet as sheet
from cembench.surfaces.catalogue import stand_in
from cembench.surfaces.rows import ROWS

from benchmarks.pages import Section


def contact_sheet() -> Section:
    """Draw the contact sheet of the stand-ins."""
    with TemporaryDirectory() as folder:
        path = sheet.contact_sheet({name: stand_in(name) for name in ROWS}, Path(folder) / "sheet")
        picture = path.read_bytes()
    return Section([], files={"reports/surfaces/contact_sheet.jpg": picture})

import io

import pytest
from PIL import Image

from cembench.report import plots
from cembench.report.content import inspection
from cembench.report.content.evidence import Evidence
from cembench.report.write_report import write_report
from tests.report.small_run import write_koebe, write_run


@pytest.fixture(scope="session")
def small_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small") / "run"
    write_run(folder)
    write_koebe(folder)
    return folder


@pytest.fixture(scope="session")
def evidence(small_run):
    return Evidence.of(small_run)


@pytest.fixture(scope="session")
def written(small_run, tmp_path_factory):
    """The report of the small run, and its folder; pictures are small."""
    folder = tmp_path_factory.mktemp("report") / "report"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inspection, "SIDE", 48)
        report = write_report(small_run, folder, "cembench report run")
    return report, folder


@pytest.fixture
def quick_drawing(monkeypatch):
    """Draw hardly anything, for what does not look at the figures."""
    png = io.BytesIO()
    Image.new("RGB", (2, 2)).save(png, "PNG")
    forms = {"png": png.getvalue(), "svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>", "pdf": b""}
    monkeypatch.setattr(plots, "_drawn", lambda plot: forms)
    monkeypatch.setattr(inspection, "SIDE", 16)

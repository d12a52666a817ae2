import io
import os
import pickle
import shutil
from contextlib import contextmanager

import pytest
from filelock import FileLock
from PIL import Image

from cembench.report import plots
from cembench.report.content import inspection
from cembench.report.content.evidence import Evidence
from cembench.report.write_report import write_report
from tests.report.small_run import write_koebe, write_run


def made_once(factory, name, make):
    """Return a copy of the folder that the first of all test processes fills by `make(folder)`."""
    base = factory.getbasetemp()
    common = base if "PYTEST_XDIST_WORKER" not in os.environ else base.parent
    original, done = common / f"{name}-made-once", common / f"{name}-made"
    with FileLock(common / f"{name}.lock"):
        if not done.exists():
            make(original)
            done.touch()
    return shutil.copytree(original, factory.mktemp(name) / name, symlinks=True)


@pytest.fixture(scope="session")
def small_run(tmp_path_factory):
    def make(folder):
        write_run(folder)
        write_koebe(folder)

    return made_once(tmp_path_factory, "run", make)


@pytest.fixture(scope="session")
def evidence(small_run):
    return Evidence.of(small_run)


@pytest.fixture(scope="session")
def written(small_run, tmp_path_factory):
    """The report of the small run, and its folder; pictures are small."""

    def make(folder):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(inspection, "SIDE", 48)
            report = write_report(small_run, folder / "report", "cembench report run")
        (folder / "report.pickle").write_bytes(pickle.dumps(report))

    folder = made_once(tmp_path_factory, "written", make)
    return pickle.loads((folder / "report.pickle").read_bytes()), folder / "report"


@contextmanager
def drawing_little():
    """Draw hardly anything, for what does not look at the figures."""
    png = io.BytesIO()
    Image.new("RGB", (2, 2)).save(png, "PNG")
    forms = {"png": png.getvalue(), "svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>", "pdf": b""}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plots, "_drawn", lambda plot: forms)
        patch.setattr(inspection, "SIDE", 16)
        yield


@pytest.fixture
def quick_drawing():
    with drawing_little():
        yield

"""The examples run; the site is built of the pages, the docstrings and the examples, unwarned."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from selenium.webdriver.support.ui import WebDriverWait

from tests.browser import open_browser

ROOT = Path(__file__).parents[2]
GALLERY = ROOT / "examples/gallery"
EXAMPLES = sorted(GALLERY.glob("plot_*.py"))
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
QUICK = ("plot_10_your_own_figure.py", "plot_16_gauge.py")


def python(*arguments, cwd):
    clean = os.environ | {"MPLBACKEND": "agg", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env=clean,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]
    return done.stdout


def test_there_are_fifteen_examples_and_two_notebooks():
    assert len(EXAMPLES) >= 15
    assert len(NOTEBOOKS) >= 2


@pytest.mark.parametrize("name", QUICK)
def test_an_example_runs(name):
    assert python(name, cwd=GALLERY)


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_runs(path):
    python(path.name, cwd=GALLERY)


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_searched_offline(tmp_path):
    pytest.importorskip("sphinx")
    python("-m", "sphinx", "-W", "--keep-going", "-q", "docs", tmp_path / "html", cwd=ROOT)
    html = tmp_path / "html"
    page = (html / "gallery/plot_01_map_a_surface.html").read_text()
    assert "sphx_glr_plot_01_map_a_surface_001.png" in page
    papers = (html / "papers.html").read_text()
    for kept in sorted((ROOT / "reports/papers").iterdir()):
        assert f'href="papers/{kept.name}/index.html"' in papers
        assert (html / "papers" / kept.name / "index.html").is_file()
    # Nothing is loaded from elsewhere, so it is read, and searched, without a network.
    for file in (html / "index.html", html / "errors.html", html / "search.html"):
        assert not re.search(r"<(script|link|img)[^>]+(src|href)=.https?:", file.read_text())
    with open_browser() as browser:
        browser.get(f"{(html / 'search.html').as_uri()}?q=folded")
        WebDriverWait(browser, 60).until(
            lambda page: "Errors and what to do" in page.find_element("id", "search-results").text
        )


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    client = pytest.importorskip("nbclient").NotebookClient
    notebook = nbformat.read(path, as_version=4)
    assert all(cell.get("outputs", []) == [] for cell in notebook.cells), "kept without outputs"
    client(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [cell for cell in notebook.cells if cell.get("outputs")]
    assert shown

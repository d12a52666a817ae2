"""Sphinx reads this: the site is made of the pages here, the docstrings and the commands."""

import logging
import os
import re
import sys
import warnings
from importlib.metadata import version as version_of
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")  # as the harness does; the gallery's examples run here

import cli_pages  # noqa: E402 - after the path
import gallery_pictures  # noqa: E402
import history_page  # noqa: E402
import paper_pages  # noqa: E402

project = "cembench"
author = "The cembench developers"
copyright = "the cembench developers, MIT licence"
release = version_of("cembench")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "_ext", "_pages", "_templates", "gallery/*.ipynb", "gallery/*.py"]

templates_path = ["_templates"]
needs_sphinx = "8.0"
suppress_warnings = ["config.cache"]  # the gallery's functions cannot be pickled

# Pages are Markdown. Links to headings work down to the third level.
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
#: A kept run of a paper is a folder in the repository, and a page in the site.
myst_url_schemes = {
    "http": None,
    "https": None,
    "mailto": None,
    "paper": {"url": "papers/{{path}}/index.html", "classes": ["paper"]},
}

# Pages of the API: one for each public name, its docstring in the sections of numpydoc.
autosummary_generate = True
autosummary_imported_members = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # numpydoc's Parameters have the types
autodoc_default_options = {"members": True}
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
add_module_names = False

# Nothing is fetched to build the site or to read it, so formulas are plain text.
html_theme = "furo"
html_title = "cembench"
html_static_path = ["_static", "preview.png"]
html_extra_path = ["_pages"]  # of papers, made when the site is built
html_css_files = ["site.css"]
html_search_scorer = str(HERE / "_static/scorer.js")
smartquotes = False  # they would make one dash of the two of an option
html_copy_source = False
html_show_sourcelink = False


sphinx_gallery_conf = {
    "examples_dirs": "../examples/gallery",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/plot_",
    "within_subsection_order": "FileNameSortKey",
    "capture_repr": ("_repr_html_", "__repr__"),
    "image_scrapers": ("matplotlib", gallery_pictures.figures),
    "matplotlib_animations": False,
    "remove_config_comments": True,
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,  # no page says how long a busy machine took
    "abort_on_example_error": True,
    "plot_gallery": "True",
}

logging.getLogger("distributed").propagate = False  # it reports each connection
warnings.filterwarnings(
    "ignore", category=UserWarning, message="FigureCanvasAgg is non-interactive"
)


def _link_to_files(app, page, source):
    """Let links to files of the repository, outside this folder, become downloads."""
    folder = (HERE / page).parent

    def link(found):
        target = (folder / found[1]).resolve()
        if target.parent == paper_pages.KEPT:
            return f"](paper:{target.name})"
        return found[0] if target.is_relative_to(HERE) else f"](path:{found[1]})"

    source[0] = re.sub(r"\]\((\.\.?/[^)#]+)\)", link, source[0])


def _keep_bars(app, what, name, object_, options, lines):
    """Keep the bars of a modulus, |mu|, from being read as a substitution."""
    for number, line in enumerate(lines):
        parts = re.split(r"(``.*?``|:\w+:`.*?`)", line)
        parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
        lines[number] = "".join(parts)


def _skip_aliases(app, what, name, object_, skip, options):
    """Leave out names for annotated types, whose texts are no documentation."""
    return True if hasattr(object_, "__metadata__") else None


def setup(app):
    """Write the pages of commands, papers and the history before anything is read."""
    cli_pages.write_page(HERE / "cli.md")
    history_page.write_page(HERE / "history.md")
    paper_pages.write_pages(HERE / "_pages/papers")
    app.connect("source-read", _link_to_files)
    app.connect("autodoc-process-docstring", _keep_bars)
    app.connect("autodoc-skip-member", _skip_aliases)
    return {"parallel_read_safe": True}

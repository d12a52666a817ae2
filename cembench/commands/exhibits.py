"""Commands that come by entry points: those of papers add exhibits of surfaces to a run.

An entry point of the group ``cembench.verbs`` names a module. What its ``__all__`` names is part of
the Python API; the function of the entry point's name becomes a command. ``loaded`` reads a
surface; ``shown``, ``facts`` and ``failures`` are what is printed of a list of results, the same as
plain data, and what went wrong. A module with a function ``add_command`` adds commands of its own;
its entry point names the function that describes the command, if that has another name.
"""

from __future__ import annotations

import inspect
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, fail, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import DEFAULT_RUN, AddTo

Surfaces = Annotated[
    list[str], typer.Argument(metavar="MESH", help="Mesh file, or a name from `list surfaces`.")
]


def add(entry: EntryPoint) -> None:
    """Add the command of an entry point."""
    verb, module = entry.name, import_module(entry.module)
    if hasattr(module, "add_command"):
        module.add_command()
        return
    function = getattr(module, verb)
    usual: Any = inspect.signature(function).parameters["surface"].default
    usual = usual if usual is inspect.Parameter.empty else [usual]

    @app.command(
        verb,
        epilog=f"Examples:  cembench {verb} face.obj  ·  cembench {verb} face.obj --run "
        "results/mine --json",
    )
    @from_api(function, without=("surface", "reporter"))
    def make(
        call: Call, surfaces: Surfaces = usual, *, run: AddTo = DEFAULT_RUN, as_json: Json = False
    ) -> None:
        """Add the exhibits of surfaces to a run, and print them."""
        from cembench.report.content.exhibits import tables_shown
        from cembench.results import exhibits, run_folder

        run_folder.check(run)
        for name in surfaces[1:]:  # a wrong one ends the command before the first takes its time
            module.loaded(name, **call.keywords)
        made = [call(name, run=run, reporter=SHOWN) for name in surfaces]
        names = " ".join(Path(name).name for name in surfaces)
        shown = module.shown(made, exhibits.command(verb, names, "", **call.keywords))
        for exhibit in shown:
            exhibits.write_exhibit(run, exhibit)
        if as_json:
            print_json(module.facts(made))
        else:
            for exhibit in shown:
                out.print(exhibit.title, style="bold", markup=False)
                out.print(tables_shown(exhibit))
                out.print(exhibit.text, markup=False)
            folder = (run / exhibits.FOLDER).resolve()
            out.print(f"\nExhibits: {folder}", soft_wrap=True, markup=False)
        fail(module.failures(made))

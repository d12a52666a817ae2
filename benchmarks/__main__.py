"""Run a study: ``python -m benchmarks NAME``; without a name, list them."""

from __future__ import annotations

import argparse
import ast
import inspect
import os
import shlex
import sys
import types
from collections.abc import Callable, Sequence
from importlib import import_module
from io import StringIO
from pathlib import Path
from time import perf_counter
from typing import Any, Literal, get_args, get_origin

from benchmarks.measuring import for_measuring
from benchmarks.origins import record
from benchmarks.pages import Section, Table
from benchmarks.stale import PAGE as STATES
from cembench.commands.exit_codes import stop_on_signals
from cembench.core.atomic import write_text

HERE = Path(__file__).parent


def studies() -> dict[str, str]:
    """Return the studies with what they do: functions named as their module."""
    summaries = {}
    for file in sorted(HERE.glob("*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and node.name == file.stem:
                summaries[file.stem] = (ast.get_docstring(node) or "").partition("\n")[0]
    return summaries


def parser_of(study: Callable[..., object]) -> argparse.ArgumentParser:
    """Make a command line of a study's signature: parameters by keyword alone are options."""
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks {study.__name__}",
        description=inspect.getdoc(study),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for name, parameter in inspect.signature(study, eval_str=True).parameters.items():
        kind, required = parameter.annotation, parameter.default is parameter.empty
        about: dict[str, Any] = {} if required else {"default": parameter.default}
        text = "" if required or not parameter.default else f"default: {parameter.default}"
        about["help"] = text.replace("%", "%%")
        if isinstance(kind, types.UnionType):  # X | None
            kind = get_args(kind)[0]
        option = parameter.kind is parameter.KEYWORD_ONLY
        if get_origin(kind) is Sequence:
            kind = get_args(kind)[0]
            about["nargs"] = "+" if option or required else "*"
            if option:  # `--hide A --hide B` is `--hide A B`, and neither adds to a default
                about |= {"action": "extend", "default": None}
        if kind is bool:
            about["action"] = "store_true"
        elif get_origin(kind) is Literal:
            about["choices"] = get_args(kind)
        else:
            about["type"] = kind
        parser.add_argument(f"--{name.replace('_', '-')}" if option else name, **about)
    return parser


def write_tables(sections: Sequence[Section], folder: Path) -> None:
    """Write tables as CSV, and what else the sections hold, to a folder."""
    tables = [part for one in sections for part in one.parts if isinstance(part, Table)]
    for number, table in enumerate(tables, 1):
        buffer = StringIO()
        table.frame.to_csv(buffer, index=False)
        write_text(folder / f"table-{number}.csv", buffer.getvalue())
    for section in sections:
        section.write_files(folder)


def main(arguments: Sequence[str]) -> None:
    """Run a study, print what it returns, and write that where it is asked for."""
    known = studies()
    if not arguments or arguments[0] in ("-h", "--help"):
        print("python -m benchmarks NAME [--help], where NAME is one of\n")
        print("\n".join(f"{name:26} {summary}" for name, summary in known.items()))
        return
    name = arguments[0].replace("-", "_")
    if name not in known:
        sys.exit(f"there is no study {arguments[0]!r}; there are {', '.join(known)}.")
    study = getattr(import_module(f"benchmarks.{name}"), name)
    parser = parser_of(study)
    parser.add_argument("--write-docs", action="store_true", help="fill the pages of the docs")
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="write tables as CSV, pictures")
    asked = vars(parser.parse_args(arguments[1:]))
    write_docs, folder = asked.pop("write_docs"), asked.pop("save")
    started = perf_counter()
    result = study(**{key: value for key, value in asked.items() if value is not None})
    seconds = perf_counter() - started
    sections = [result] if isinstance(result, Section) else list(result)
    print("\n\n".join(map(str, sections)))
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
        write_tables(sections, folder)
    for section in sections if write_docs else ():
        section.write(name)
        if section.page and section.page != STATES:
            command = shlex.join(["python", "-m", "benchmarks", *map(without_folder, arguments)])
            record(f"{section.page} {name}", f"benchmarks/{name}.py", command, seconds)


def without_folder(word: str) -> str:
    """Return an argument for others: of a path outside the repository its name alone.

    >>> [without_folder(word) for word in ("../meshes/face.obj@1", "--rounds", "reports/real")]
    ['face.obj@1', '--rounds', 'reports/real']
    """
    return Path(word).name if word.startswith(("..", "/")) else word


if __name__ == "__main__":
    # One thread, and memory as in timed processes: libraries read it when they are loaded.
    if dict(os.environ) != (environment := for_measuring(1)):
        os.execve(sys.executable, [sys.executable, "-m", "benchmarks", *sys.argv[1:]], environment)
    stop_on_signals()
    main(sys.argv[1:])

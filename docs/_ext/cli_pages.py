"""Write the reference of the command line from the commands themselves."""

from __future__ import annotations

import re
from enum import Enum
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import typer

from cembench.commands.cli import app
from cembench.core.atomic import write_text

HEAD = """\
# Command line

Made from the commands. `cembench VERB --help` prints the same in a terminal. Every verb that has
`--json` prints plain data with the names of the Python API.

| exit code | meaning |
|---|---|
| 0 | everything that was asked for ended ok |
| 1 | something did not: a cell, a map, a requirement |
| 2 | the call or the input was wrong; nothing was written |
| 70 | a fault of cembench itself; its traceback is in a file that the message names |
| 74 | the system refused a file |
| 128 + n | ended by signal n; a closed pipe gives 141 |
"""


def write_page(path: Path) -> None:
    """Write the page, unless it is there and the same."""
    text = page()
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_text(path, text)


def page() -> str:
    """Return the page in Markdown: the list of verbs, then one section a verb."""
    verbs = commands()
    lines = [HEAD, "| verb | what it does |", "|---|---|"]
    lines += [f"| [{name}](#cembench-{name}) | {_summary(verb)} |" for name, verb in verbs.items()]
    return "\n".join(lines) + "\n\n" + "\n".join(section(n, v) for n, v in verbs.items())


def commands() -> dict[str, Any]:
    """Return the verbs by name, in the order of the help."""
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="cembench")
    names = group.list_commands(context)
    return {name: group.get_command(context, name) for name in names}


def section(name: str, verb: Any) -> str:
    """Return the section of one verb: usage, text, arguments, options, examples."""
    context = typer.Context(verb, info_name=f"cembench {name}")
    usage = " ".join(verb.collect_usage_pieces(context))
    lines = [f"## cembench {name}", "", f"```console\n$ cembench {name} {usage}\n```", ""]
    lines += [_escaped(_unwrapped(verb.help or "")), ""]
    arguments = [p for p in verb.params if p.param_type_name == "argument"]
    options = [p for p in verb.params if p.param_type_name == "option" and not p.hidden]
    for title, some in (("argument", arguments), ("option", options)):
        if some:
            lines += [f"| {title} | meaning |", "|---|---|"]
            lines += [f"| {_names(p)} | {_meaning(p, context)} |" for p in some] + [""]
    examples = [e for e in re.split(r"\s+·\s+", (verb.epilog or "").strip()) if e]
    if examples:
        examples[0] = re.sub(r"^Examples?:\s*", "", examples[0])
        shown = "\n".join(f"$ {one}" for one in examples)
        lines += ["Examples:", "", f"```console\n{shown}\n```", ""]
    return "\n".join(lines)


def _names(one: Any) -> str:
    value = one.metavar or _type(one)
    if one.param_type_name == "argument":
        return _code(value if one.metavar else one.name.upper())
    names = [*one.opts, *one.secondary_opts]
    if not one.is_flag:
        names[-1] += f" {value}"
    return ", ".join(_code(name) for name in names)


def _type(one: Any) -> str:
    """Return what a value of an option is called: its choices, or its type in capitals."""
    descriptor = getattr(one, "type_descriptor", None)
    kind = getattr(descriptor, "annotation", None)  # typer from 0.26 on; before, click's type
    parts = [part for part in (*get_args(kind), kind) if isinstance(part, type)]
    if kind is None:
        return str(one.type.name).upper()
    literal = next((k for k in (kind, *get_args(kind)) if get_origin(k) is Literal), None)
    if literal is not None:
        return "|".join(get_args(literal))
    if issubclass(parts[0], Enum):
        return "|".join(str(choice.value) for choice in parts[0])
    return {int: "N", float: "N", Path: "PATH"}.get(parts[0], "NAME")


def _meaning(one: Any, context: typer.Context) -> str:
    text = _escaped(" ".join((getattr(one, "help", None) or "").split()))
    default = one.get_default(context, call=False)
    if not getattr(one, "is_flag", False) and default not in (None, [], (), ""):
        several = default if isinstance(default, list | tuple) else [default]
        shown = ", ".join(str(getattr(value, "value", value)) for value in several)
        text += f" Default: {_code(shown)}."
    if one.required:
        text += " Required."
    return text.strip()


def _summary(verb: Any) -> str:
    return _escaped(_unwrapped(verb.help or "").split("\n\n")[0])


def _unwrapped(text: str) -> str:
    """Return a help text with its paragraphs on one line each."""
    text = text.replace("\b\n", "")
    return "\n\n".join(" ".join(part.split()) for part in re.split(r"\n\s*\n", text.strip()))


def _escaped(text: str) -> str:
    return re.sub(r"([|*<>\[\]_])", r"\\\1", text)


def _code(text: str) -> str:
    return "`" + text.replace("|", "\\|") + "`"

"""The command `fetch`: download public surfaces."""

from __future__ import annotations

from cembench.api.fetch import fetch as fetch_surfaces
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, fail, out, print_json
from cembench.commands.from_api import Call, from_api


@app.command(
    epilog="Examples:  cembench fetch  ·  cembench fetch --group disks  ·  cembench fetch left-hand"
)
@from_api(fetch_surfaces, without=("reporter",), names="NAME")
def fetch(call: Call, *, as_json: Json = False) -> None:
    """Print the paths, or all surfaces if none was asked for; exit with 1 if one failed."""
    fetched = call(reporter=SHOWN)
    if as_json:
        print_json(fetched.rows)
    elif not (call.keywords["names"] or call.keywords["group"]):
        _list(fetched.rows)
    else:
        for row in fetched.rows:
            only = " (no licence stated: do not redistribute)" if row["fetch_only"] else ""
            if "error" not in row:
                out.print(f"{row['name']}: {row['path']}{only}", soft_wrap=True)
    fail(map(str, fetched.failed.values()))


def _list(rows: list[dict[str, object]]) -> None:
    from cembench.registry import load_registry
    from cembench.report.listings import datasets_table

    out.print(datasets_table(rows))
    registry = load_registry()
    models = {p.group: len(registry.group(p.group)) for p in registry.parts.values()}
    for name, count in models.items():
        out.print(f"{name}: {count} files of a model, fetched with --group {name}")

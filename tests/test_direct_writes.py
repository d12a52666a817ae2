"""Everything that is written to stay goes through `cembench.core.atomic`, and nothing beside it.

What passes between processes lies in a folder that is deleted afterwards, and may be written
directly. Such places are listed below, each with its reason.
"""

import ast
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
PACKAGES = (
    "algorithms",
    "benchmarks",
    "cembench",
    "examples",
    "meshes_gen",
    "papers",
    "sharing",
    "textures",
)
#: Functions that may write directly, and why.
ALLOWED = {
    "benchmarks/kept_run.py": "a copy that is made again when it was cut off",
    "cembench/core/atomic.py": "it is the place",
    "cembench/core/folders.py:publish": "moves files that were flushed and checked as drafts",
    "papers/cem/morphing/writers.py:write_meshes": "moves checked drafts",
    "cembench/results/samples.py:append_line": "a journal grows by a line; a cut one is dropped",
    "cembench/running/launcher.py": "between processes, in the scratch folder",
    "cembench/running/timing.py": "between processes, in the scratch folder",
    "cembench/running/external/exchange.py:write_input": "a program's own folder, temporary",
    "cembench/running/external/call.py:_ended": "what a program prints, in a temporary folder",
    "algorithms/peers/blender_unwrap.py:main": "a program's own folder, temporary",
    "examples/external/tutte.py": "a program on its own, in a folder that is deleted",
    "cembench/running/plugins.py:_main": "between processes, in a temporary folder",
    "cembench/running/sanitized_result.py:_extras": "pydantic_core.to_json gives text",
    "cembench/running/process.py": "the output of a process, in the scratch folder",
    "cembench/running/relay.py:__call__": "between processes, in a temporary folder",
    "cembench/running/version_server.py:mapped": "between processes, in a temporary folder",
    "cembench/api/compare.py:compare_versions": "a plug-in in a temporary folder",
    "cembench/running/worker.py": "between processes, in the scratch folder",
    "cembench/running/memory.py": "a switch of the system, not a file",
}
#: Methods and functions that take a path, write there, and report no full disk or replace at once.
WRITING = {
    *("write_text", "write_bytes", "savefig", "imsave", "imwrite", "save", "savez", "savetxt"),
    *("savez_compressed", "export", "tofile", "to_csv", "to_json", "to_parquet", "write_image"),
    *("write_table", "write_html", "open_memmap", "rename", "renames", "copyfile", "copy2", "move"),
    *("copytree", "symlink_to", "hardlink_to", "link", "symlink", "truncate", "writeOBJ"),
    *("writePLY", "writeSTL", "writeOFF", "write_triangle_mesh"),
}
#: What an open file is called where `atomic.write` or memory gives one.
OPEN_FILES = {"file", "buffer"}
#: Functions and objects of ours that have such names and write through `atomic`, or not at all.
OURS, OUR_OBJECTS = (
    ("write_bytes", "write_text", "write_html", "move"),
    ("store", "self", "into", "self.store", "self.recorder"),
)


def writes(call):
    """Whether a call writes to a path, or gives a file its name."""
    function, method = call.func, isinstance(call.func, ast.Attribute)
    name = function.attr if method else getattr(function, "id", "")
    owner = ast.unparse(function.value) if method else ""
    if name == "open":
        given = [*call.args, *(keyword.value for keyword in call.keywords)]
        modes = [str(one.value) for one in given if isinstance(one, ast.Constant)]
        return any(set(mode) <= set("rwxabt+") and set(mode) & set("wxa+") for mode in modes)
    if name in ("replace", "rename"):  # of a path one argument; a text two, a frame keywords
        return owner == "os" or (method and len(call.args) == 1 and not call.keywords)
    if (not method and name in OURS) or owner in OUR_OBJECTS:
        return False
    given_file = any(isinstance(one, ast.Name) and one.id in OPEN_FILES for one in call.args)
    return name in WRITING and not given_file


def direct_writes(source):
    """The calls of a source that write to a path, with the functions that they stand in."""
    collected = []

    def visit(node, inside):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inside = node.name
        if isinstance(node, ast.Call) and writes(node):
            collected.append((inside, node.lineno))
        for child in ast.iter_child_nodes(node):
            visit(child, inside)

    visit(ast.parse(source), "")
    return collected


def test_no_code_writes_files_but_through_one_function():
    offenders, used = [], set()
    for package in PACKAGES:
        for path in sorted((PROJECT / package).rglob("*.py")):
            place = path.relative_to(PROJECT).as_posix()
            for inside, line in direct_writes(path.read_text()):
                allowed = {place, f"{place}:{inside}"} & set(ALLOWED)
                used |= allowed
                if not allowed:
                    offenders.append(f"{place}:{line} in {inside}")
    assert offenders == []
    assert set(ALLOWED) - used == set(), "no longer needed in ALLOWED"


@pytest.mark.parametrize(
    "code",
    [
        "open(path, 'w')",
        "path.open('wb')",
        "path.open(mode='a')",
        "gzip.open(path, 'wt')",
        "path.write_text('x')",
        "path.write_bytes(b'x')",
        "figure.savefig(path)",
        "np.savez(path, a=1)",
        "np.save(folder / 'a.npy', a)",
        "picture.save(path, 'PNG')",
        "draft.replace(path)",
        "os.replace(draft, path)",
        "shutil.copyfile(a, b)",
        "igl.writeOBJ(path, V, F)",
        "igl.writeSTL(path, V, F)",
    ],
)
def test_a_direct_write_is_noticed(code):
    assert direct_writes(f"def f():\n    {code}") == [("f", 2)]


@pytest.mark.parametrize(
    "code",
    [
        "path.open('rb')",
        "open(path)",
        "Image.open(path)",
        "text.replace('a', 'b')",
        "replace(mesh, V=V)",
        "now.replace(microsecond=0)",
        "write_bytes(path, content)",
        "write(path, lambda file: np.savez(file, a=1))",
        "figure.savefig(buffer, format='png')",
    ],
)
def test_what_is_no_direct_write_is_not(code):
    assert direct_writes(f"def f():\n    {code}") == []

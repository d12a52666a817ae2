"""What a plug-in does while it is imported ends another process than ours, and is told."""

import os
import sys
import textwrap

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import RegistryError
from cembench.mesh.files import read_mesh, write_mesh
from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running import environment
from cembench.running.local import run_tasks
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.plugins import load_with_plugins

GOOD = """
    from cembench import DiskMesh, Parameterization, algorithm

    @algorithm("mine", title="Mine", target="disk")
    def mine(mesh: DiskMesh) -> Parameterization:
        '''It is only declared.'''
"""


@pytest.fixture
def plugin(tmp_path):
    def write(text, name="plugin.py"):
        path = tmp_path / name
        path.write_text(textwrap.dedent(GOOD) + textwrap.dedent(text))
        return str(path)

    return write


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("import os; os._exit(0)", "the importing process ended with code 0"),
        ("print('last words', flush=True); import os; os._exit(3)", "code 3: last words"),
        ("import os, signal; os.kill(os.getpid(), 37)", "ended by signal 37"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt: "),
    ],
)
def test_what_ends_the_import_of_a_plugin_is_told(plugin, text, cause):
    path = plugin(text)
    with pytest.raises(RegistryError) as caught:
        load_with_plugins([path])
    assert str(caught.value).startswith(f"plug-in {path!r} cannot be imported: ")
    assert cause in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("print('Last words.', flush=True); import os; os._exit(3)", "Last words. Repair it: imp"),
        ("raise ValueError('Not here.')", " cannot be imported: ValueError: Not here. Repair it."),
        ("algorithm('a', title='A', target='sphere')(mine)", ": algorithm 'a': target 'sphere'"),
    ],
)
def test_what_is_wrong_with_a_plugin_is_told_in_whole_sentences(plugin, text, told):
    with pytest.raises(RegistryError) as caught:
        load_with_plugins([plugin(text)])
    assert told in str(caught.value)
    assert ".." not in str(caught.value)
    assert ("declare functions" in str(caught.value)) == ("exit" in text)


def test_a_plugin_that_is_never_done_importing_is_told(plugin):
    with pytest.raises(RegistryError, match=r"the import took more than 0\.5 s\. Repair it"):
        load_with_plugins([plugin("while True: pass")], 0.5)


def test_a_good_plugin_is_loaded(plugin):
    assert load_with_plugins([plugin("")]).algorithm("mine").title == "Mine"


def test_what_an_import_changes_in_the_environment_no_measuring_process_gets(plugin, monkeypatch):
    monkeypatch.setattr(environment, "_CHANGED", {})
    for name, value in {"GIVEN": "user's", "KEPT": "user's", "NEW": ""}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NEW")
    changes = "import os; os.environ.update(GIVEN='other', NEW='1', GLIBC_TUNABLES='a=b')"
    monkeypatch.setenv("GLIBC_TUNABLES", "c=d")
    load_with_plugins([plugin(changes)])
    assert os.environ["GIVEN"] == "other"  # for what the plug-in does in this process
    found = environment.for_measuring(1)
    assert (found["GIVEN"], found["KEPT"]) == ("user's", "user's")
    assert "NEW" not in found
    assert found["GLIBC_TUNABLES"].startswith("c=d:")


@pytest.mark.parametrize("verb", [["run", "--plugin"], ["validate"]])
def test_the_command_line_ends_with_2_and_names_the_plugin(cli, plugin, verb):
    path = plugin("import os; os._exit(0)")
    code, out, err = cli(*verb, path)
    assert (code, out) == (2, "")
    assert path in err
    assert "ended with code 0" in err


def test_what_a_plugin_prints_goes_to_standard_error(plugin, capfd):
    path = plugin("import os; print('la'); os.write(1, b'lo\\n')")
    load_registry([path])
    print("after")
    out, err = capfd.readouterr()
    assert out == "after\n"
    assert {"la", "lo"} <= set(err.split())


@pytest.fixture
def hiding(tmp_path, monkeypatch):
    """The current folder has files with the names of modules that cembench needs."""
    here = tmp_path / "here"
    here.mkdir()
    for name in ("queue", "numpy", "trimesh"):
        (here / f"{name}.py").write_text("raise ImportError('hidden')")
    monkeypatch.chdir(here)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield here
    for name in ("beside_a_plugin", "named_plugin"):
        sys.modules.pop(name, None)


NEIGHBOUR = """
    from beside_a_plugin import NUMBER

    @algorithm("ours", title="Ours", target="free boundary")
    def ours(mesh: DiskMesh) -> Parameterization:
        return Parameterization(mesh.V[:, 0] + NUMBER * mesh.V[:, 1])
"""


@pytest.mark.parametrize("threads", [1, 2])
def test_files_of_the_current_folder_hide_no_library(plugin, hiding, tmp_path, threads):
    (tmp_path / "beside_a_plugin.py").write_text("NUMBER = 1j")
    path = plugin(NEIGHBOUR)
    ours = load_with_plugins([path]).algorithm("ours")
    settings = MeasurementSettings(repeats=1, threads=threads)
    tasks = plan_cells([ours], [flat_disk(100)], {}, settings, [path])
    (record,) = run_tasks(tasks, Store(tmp_path / "run"))
    assert record.outcome.status == "ok", record.outcome.cause


def test_a_module_of_the_current_folder_is_a_plugin(plugin, hiding):
    plugin("", hiding / "named_plugin.py")
    assert load_with_plugins(["named_plugin:mine"]).algorithm("mine").title == "Mine"


@pytest.mark.usefixtures("hiding")
def test_a_library_that_reads_a_file_is_not_hidden(tmp_path):
    pytest.importorskip("trimesh")
    write_mesh(tmp_path / "a.glb", flat_disk(100))
    assert read_mesh(tmp_path / "a.glb").n == flat_disk(100).n

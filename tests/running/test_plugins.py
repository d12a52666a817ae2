"""What a plug-in does while it is imported ends another process than ours, and is told."""

import os
import textwrap

import pytest

from cembench import RegistryError
from cembench.registry import load_registry
from cembench.running import environment
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

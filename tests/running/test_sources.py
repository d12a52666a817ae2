"""An edited plug-in is another algorithm, whichever of its files was edited."""

import sys
import textwrap

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import RegistryError
from cembench.registry import load_registry
from cembench.running.local import map_once
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.sources import code_hash, sources_of

HEAD = """
    import functools, sys
    from pathlib import Path
    sys.path.insert(0, str(Path(__file__).parent))
    from cembench import DiskMesh, Parameterization, algorithm
"""
BODY = """
    def mine(mesh: DiskMesh) -> Parameterization:
        return Parameterization(mesh.V[:, 0] + 1j * mesh.V[:, 1])
"""
DECLARATION = '@algorithm("mine", title="Mine", target="disk")'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of modules, none of which stays imported."""

    def forget():
        for name, module in list(sys.modules.items()):
            if str(getattr(module, "__file__", None)).startswith(str(tmp_path)):
                del sys.modules[name]

    monkeypatch.setattr(sys, "path", list(sys.path))

    def write(**files):
        for name, text in files.items():
            path = tmp_path.joinpath(*name.split("__in__")[::-1]).with_suffix(".py")
            path.parent.mkdir(exist_ok=True)
            path.write_text(textwrap.dedent(text))
        forget()
        return load_registry([str(tmp_path / "plugin.py")]).algorithm("mine")

    write.path = tmp_path
    yield write
    forget()


def declared(*decorators, head=""):
    parts = [textwrap.dedent(HEAD), head, *decorators, textwrap.dedent(BODY).strip()]
    return "\n".join(parts) + "\n"


def test_a_single_file_is_hashed_as_it_always_was(folder):
    import hashlib

    spec = folder(plugin=declared(DECLARATION))
    whole = hashlib.sha256((folder.path / "plugin.py").read_bytes()).hexdigest()
    assert code_hash(spec) == whole
    assert sources_of(spec) == {"plugin.py": whole}
    own = load_registry().algorithm("direct-cem-holes")
    assert code_hash(own) == hashlib.sha256(own.file.read_bytes()).hexdigest()


DECORATORS = """
    import functools

    def wrapping(function):
        @functools.wraps(function)
        def wrapper(*arguments, **options):
            return function(*arguments, **options)
        return wrapper

    def hiding(function):
        from cembench import DiskMesh, Parameterization
        def wrapper(mesh: DiskMesh) -> Parameterization:
            return function(mesh)
        return wrapper
"""


CALLABLES = """
class Called:
    def __init__(self, function):
        self.function = function
    def __call__(self, mesh: DiskMesh) -> Parameterization:
        return self.function(mesh)
from decorators import hiding, wrapping
"""


@pytest.mark.parametrize(
    "decorators",
    [
        (DECLARATION, "@wrapping"),
        ("@wrapping", DECLARATION),
        (DECLARATION, "@hiding"),
        (DECLARATION, "@functools.lru_cache"),
        (DECLARATION, "@functools.partial"),
        (DECLARATION, "@Called"),
    ],
)
def test_a_decorated_plugin_is_known_by_its_own_file(folder, decorators):
    text = declared(*decorators, head=CALLABLES)
    spec = folder(plugin=text, decorators=DECORATORS)
    assert set(sources_of(spec)) == {"plugin.py", "decorators.py"}
    before = code_hash(spec)
    after = code_hash(folder(plugin=text + "\n# edited\n"))
    assert before != after
    assert code_hash(folder(plugin=text)) == before
    assert code_hash(folder(decorators=textwrap.dedent(DECORATORS) + "# edited\n")) != before


def test_what_a_plugin_imports_from_its_folder_counts_directly_or_not(folder):
    head = "import first\nfrom package import part"
    text = declared(DECLARATION, head=head) + (
        "def late():\n    import importlib\n    importlib.import_module('by_name')\n"
    )
    files = {
        "plugin": text,
        "first": "import second, numpy",
        "second": "import first",
        "__init____in__package": "",
        "part__in__package": "from . import other\nfrom .deep import x",
        "other__in__package": "",
        "deep__in__package": "x = 1",
        "by_name": "",
        "numbers_that_nobody_imports": "",
    }
    spec = folder(**files)
    assert sorted(sources_of(spec)) == [
        "by_name.py",
        "first.py",
        "package/__init__.py",
        "package/deep.py",
        "package/other.py",
        "package/part.py",
        "plugin.py",
        "second.py",
    ]
    before = code_hash(spec)
    assert code_hash(folder(deep__in__package="x = 2")) != before


def test_a_module_of_a_package_counts_with_its_package_alone(folder):
    text = declared(DECLARATION) + "from . import helper\nimport beside\n"
    folder(plugin=declared(DECLARATION), beside="", __init____in__mine="", helper__in__mine="")
    folder(algo__in__mine=text)
    spec = load_registry(["mine.algo:mine"]).algorithm("mine")
    assert sorted(sources_of(spec)) == ["mine/__init__.py", "mine/algo.py", "mine/helper.py"]


def test_the_record_says_what_was_hashed(folder):
    spec = folder(plugin=declared(DECLARATION, head="import helper"), helper="")
    plugin = str(folder.path / "plugin.py")
    (task,) = plan_cells([spec], [flat_disk(100)], {}, MeasurementSettings(repeats=1), [plugin])
    record, _ = map_once(task)
    assert record.outcome.status == "ok", record.outcome.cause
    assert record.sources == sources_of(spec)
    assert type(record).model_validate_json(record.model_dump_json()) == record
    older = record.model_dump(exclude={"sources": True, "outcome": {"faults"}})
    assert type(record).model_validate(older).sources == {}


@pytest.mark.parametrize("target", ["len", "functools.partial(len)", "5"])
def test_a_callable_without_annotations_is_refused(folder, target):
    with pytest.raises(RegistryError, match=r"'mine'.*(cannot be read|annotated)"):
        folder(plugin=textwrap.dedent(HEAD) + f"found = {DECLARATION[1:]}({target})\n")

"""The default installation is light: what it leaves out is named when it is needed."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import cembench
from cembench.core.extras import MODULES, Extra, MissingExtra, command, missing, require
from cembench.report.export import export_rows

ROOT = Path(__file__).parents[2]
#: Where the name of a module is not that of what is installed.
DISTRIBUTIONS = {
    "skimage": "scikit-image",
    "imageio_ffmpeg": "imageio-ffmpeg",
    "dask_jobqueue": "dask-jobqueue",
}


def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def names(requirements):
    return {requirement.split(">=")[0] for requirement in requirements}


def test_the_extras_are_those_of_the_package():
    declared = project()["optional-dependencies"]
    for extra in Extra:
        modules = MODULES[extra]
        assert names(declared[extra]) == {DISTRIBUTIONS.get(m, m) for m in modules}
    everything = declared["all"][0].removeprefix("cembench[").removesuffix("]").split(",")
    assert set(everything) == set(Extra) - {
        Extra.METIS,
        Extra.PARDISO,
        Extra.VTP,
        Extra.XATLAS,
    }
    assert set(declared) == {*Extra, "all", "docs", "tables", "test"}
    assert declared["tables"] == []  # the name installs, and brings nothing more


def test_no_extra_is_in_the_default_installation():
    brought = {DISTRIBUTIONS.get(m, m) for modules in MODULES.values() for m in modules}
    assert not brought & names(project()["dependencies"])


def block(monkeypatch, *modules):
    for module in modules:
        monkeypatch.setitem(sys.modules, module, None)


def test_a_missing_module_is_named_with_its_extra(monkeypatch):
    block(monkeypatch, "plotly")
    assert missing(Extra.REPORT) == ["plotly"]
    require(Extra.REPORT, "a table", "numpy")
    with pytest.raises(MissingExtra) as found:
        require(Extra.REPORT, "a report")
    assert found.value.extra is Extra.REPORT
    assert str(found.value).startswith("a report needs plotly")
    assert command(Extra.REPORT) in str(found.value)


def fetching(folder):
    from cembench.mesh.datasets import Dataset, fetch

    fetch(Dataset("a", "A", "http://127.0.0.1:9/a.obj", "0" * 64, "MIT"))


def parquet(folder):
    export_rows([{"a": 1}], folder / "a.parquet", "parquet")


def a_stand_in(folder):
    cembench.surface("cowboy-hat-stand-in", 1000)


def a_film(folder):
    from cembench.papers.cem.morphing.writers import check_output

    check_output(folder / "a.mp4")


@pytest.mark.parametrize(
    ("use", "module", "extra"),
    [
        (fetching, "requests", Extra.FETCH),
        (parquet, "pyarrow", Extra.PARQUET),
        (a_stand_in, "skimage", Extra.STANDINS),
        (a_film, "imageio_ffmpeg", Extra.VIDEO),
    ],
)
def test_each_use_names_its_extra_and_leaves_nothing(use, module, extra, tmp_path, monkeypatch):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    block(monkeypatch, module)
    with pytest.raises(MissingExtra) as found:
        use(tmp_path)
    assert found.value.extra is extra
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_the_command_line_says_it_before_it_measures(capsys, monkeypatch, tmp_path):
    from cembench.commands.cli import main

    block(monkeypatch, "skimage")
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path / "cache"))
    words = ("run", "--surfaces", "cowboy-hat-stand-in", "--faces", "600", "-a", "lscm")
    monkeypatch.setattr(sys, "argv", ["cembench", *words, "-o", str(tmp_path / "run")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "cembench[standins]" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.process
def test_without_cvxopt_superlu_factors():
    code = (
        "import sys; sys.modules['cvxopt'] = None\n"
        "import cembench\n"
        "from cembench.linear_algebra.backends import available_backends, default_backend\n"
        "mesh = cembench.surface('hemi-ellipsoid', 300)\n"
        "print(cembench.parameterize(mesh, 'cem').ok, default_backend(), *available_backends())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.split()[:3] == ["True", "superlu", "superlu"], done.stderr

import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.tracked import algorithms, cases
from benchmarks.tracked import kernels as kernels_module
from cembench.mesh.triangle_mesh import DiskMesh
from tests.real_meshes import real_mesh

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("wanted", "there"), [("quick", False), ("all", True)])
def test_what_takes_long_is_there_only_on_request(monkeypatch, wanted, there):
    monkeypatch.setenv(cases.VARIABLE, wanted)
    monkeypatch.delitem(sys.modules, algorithms.__name__)
    module = importlib.import_module(algorithms.__name__)
    assert hasattr(module, "MoreDisks") == there
    assert hasattr(module, "Disks")


@pytest.mark.parametrize("algorithm", cases.algorithm_names(DiskMesh))
def test_every_disk_algorithm_is_tracked_by_its_energy_angles_and_folds(algorithm):
    bench = algorithms.Disks()
    case = (algorithm, "spherical-cap", 2_000)
    bench.setup(*case)
    assert bench.track_folds(*case) == 0
    assert 0 < bench.track_conformal_energy(*case) < 0.1
    assert 0 < bench.track_angle_error(*case) < 10


def test_the_fields_algorithms_are_tracked_and_real_disks_where_they_are_at_hand(monkeypatch):
    assert {"bff", "cetm-flips", "scp"} <= set(cases.field_names())
    assert not {"best", "cem"} & set(cases.field_names())
    assert algorithms.Field.params[0] == cases.field_names()
    folder = real_mesh("demosthenes.off").parent
    for there, names in ((str(folder), cases.REAL), ("nowhere", ())):
        monkeypatch.setenv(cases.MESHES_VARIABLE, there)
        monkeypatch.delitem(sys.modules, algorithms.__name__)
        module = importlib.import_module(algorithms.__name__)
        assert hasattr(module, "RealDisks") == bool(names)
        if names:
            assert module.RealDisks.params[1] == list(names)
            bench = module.RealDisks()
            bench.setup("direct-cem", "demosthenes.off")
            assert bench.track_folds("direct-cem", "demosthenes.off") == 0


def test_versions_are_pinned_so_that_an_edit_does_not_drop_history():
    for suite in (algorithms.Disks, algorithms.Holed, kernels_module.Kernels):
        assert suite.version == "1"


@pytest.mark.slow
def test_asv_measures_with_an_existing_environment(tmp_path):
    conf = json.loads((ROOT / "asv.conf.json").read_text())
    conf |= {"repo": str(ROOT), "benchmark_dir": str(ROOT / "benchmarks/tracked")}
    conf |= {key: str(tmp_path / key) for key in ("env_dir", "results_dir", "html_dir")}
    file = tmp_path / "asv.conf.json"
    file.write_text(json.dumps(conf))

    def asv(*words):
        return subprocess.run(
            [sys.executable, "-m", "asv", *words], cwd=tmp_path, capture_output=True, text=True
        )

    asv("machine", "--yes", "--config", str(file))
    head = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()
    ran = asv(
        *("run", "--config", str(file), "--python=same", f"--set-commit-hash={head}"),
        *("--quick", "--bench", "algorithms.Disks.track_folds|boundary_loops"),
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "cem" in ran.stdout
    assert "failed" not in ran.stdout
    published = asv("publish", "--config", str(file))
    assert published.returncode == 0, published.stdout + published.stderr
    assert (tmp_path / "html_dir/index.html").is_file()

"""Who signed a run is known, and a run that was changed since is refused."""

import shutil
import subprocess

import pytest

from cembench.core.errors import ParameterError, RecordError
from cembench.results.records import signed
from cembench.results.signing import sign, signer
from cembench.results.store import Store, read_record
from tests.records import changed
from tests.report.small_run import write_koebe, write_run

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(
        shutil.which("ssh-keygen") is None, reason="NOT CHECKED: there is no ssh-keygen"
    ),
]


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    folder = tmp_path_factory.mktemp("signed") / "run"
    write_run(folder)
    write_koebe(folder)
    return folder


@pytest.fixture
def run(original, tmp_path):
    shutil.copytree(original, tmp_path / "run")
    return tmp_path / "run"


@pytest.fixture
def keys(tmp_path):
    """Keys of two people, and a file that names the first."""
    for name in ("ada", "eve"):
        words = ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(tmp_path / name)]
        subprocess.run(words, check=True)
    signers = tmp_path / "signers"
    signers.write_text(f"ada@example.org {(tmp_path / 'ada.pub').read_text()}")
    return tmp_path / "ada", tmp_path / "eve", signers


def test_the_signer_of_a_run_is_known(run, keys):
    ada, _, signers = keys
    assert sign(run, ada) == run / "signature"
    assert signer(run, signers) == "ada@example.org"


def test_seconds_that_were_edited_with_a_new_digest_are_noticed(run, keys):
    ada, _, signers = keys
    sign(run, ada)
    path = Store(run).record_files()[0]
    record = read_record(path)
    calls = [(1e-6,), *(one.calls for one in record.outcome.rounds[1:])]
    path.write_bytes(signed(changed(record, {"calls": calls})))
    assert Store(run).find(record.cell) is not None, "its digest is right"
    with pytest.raises(RecordError, match=r"was changed after ada@example\.org signed it"):
        signer(run, signers)


@pytest.mark.parametrize("pattern", ["maps/*", "meshes/*", "environments/*", "exhibits/*/*"])
def test_a_file_that_is_gone_or_new_or_other_is_noticed(run, keys, pattern):
    ada, _, signers = keys
    sign(run, ada)
    path = min(run.glob(pattern))
    content = path.read_bytes()
    for change in (
        path.unlink,
        lambda: path.write_bytes(content + b" "),
        lambda: path.rename(path.with_name("another.json")),
    ):
        change()
        with pytest.raises(RecordError, match="was changed"):
            signer(run, signers)
        path.with_name("another.json").unlink(missing_ok=True)
        path.write_bytes(content)
        assert signer(run, signers) == "ada@example.org"


def test_a_run_that_nobody_known_signed_is_refused(run, keys):
    _, eve, signers = keys
    with pytest.raises(RecordError, match="is not signed; its measurer can run `cembench sign"):
        signer(run, signers)
    sign(run, eve)
    with pytest.raises(RecordError, match="signed by nobody whom"):
        signer(run, signers)


def test_a_signature_for_another_purpose_is_refused(run, keys):
    ada, _, signers = keys
    sign(run, ada)
    signers.write_text(signers.read_text().replace("ssh-ed25519", 'namespaces="git" ssh-ed25519'))
    with pytest.raises(RecordError, match=r"signed by nobody|was changed"):
        signer(run, signers)


def test_links_are_not_followed_and_what_is_missing_is_named(run, keys, tmp_path, monkeypatch):
    ada, _, _ = keys
    with pytest.raises(ParameterError, match="does not sign with"):
        sign(run, tmp_path / "none")
    with pytest.raises(ParameterError, match="allowed signers, does not exist"):
        signer(run, tmp_path / "none")
    with pytest.raises(RecordError, match="holds no run"):
        sign(tmp_path, ada)
    (run / "maps" / "link.npz").symlink_to(ada)
    with pytest.raises(RecordError, match="is a symbolic link"):
        sign(run, ada)
    (run / "maps" / "link.npz").unlink()
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ParameterError, match="ssh-keygen is not installed"):
        sign(run, ada)


def test_merge_and_publish_take_signed_runs_alone(run, keys, cli):
    ada, _, signers = keys
    required = ("--require-signed", signers)
    for verb in ("merge", "publish"):
        code, _, err = cli(verb, run, "-o", f"by-{verb}", *required)
        assert code == 2
        assert "is not signed" in err
        assert not (cli.folder / f"by-{verb}").exists()
    code, out, _ = cli("sign", run, "--key", ada)
    assert (code, out.split()[0]) == (0, "signed:")
    code, _, err = cli("merge", run, "-o", "merged", *required)
    assert code == 0
    assert "signed by ada@example.org" in err

"""The short part of the campaign, and how a campaign is kept and resumed."""

import json

import pytest

from tests.campaign import campaign, kills, project, summary
from tests.campaign.campaign import Part, Targets, parts
from tests.campaign.hard_meshes import FAMILIES as MESH_FAMILIES
from tests.campaign.journal import Entry, Journal, WrongFolder
from tests.campaign.limited import Ending, Limits
from tests.campaign.meshes import takes
from tests.campaign.seed_files import FAMILIES as FILE_FAMILIES
from tests.fuzz.conftest import entries_of, run_campaign

ABOUT = {"seed": 1, "sources": "abc"}


def shown(entries):
    return "\n".join(f"{e.id} ({e.family}): {e.fault}: {e.detail}" for e in entries if e.fault)


@pytest.mark.parametrize("family", FILE_FAMILIES)
def test_no_mutated_file_of_a_format_makes_a_fault(family, tried):
    items = [e for e in tried if e.part == "files" and e.family == family]
    assert len(items) in (33, 34)  # 300 over nine families
    assert not shown(items), shown(items)


@pytest.mark.parametrize("algorithm", project.algorithms())
def test_no_hard_mesh_makes_a_fault(algorithm, tried):
    items = [e for e in tried if e.part == "meshes" and e.case.endswith(f"/{algorithm}")]
    taken = {name for k, name in enumerate(MESH_FAMILIES) if takes(k, algorithm)}
    assert {e.family for e in items} == taken
    assert any(e.outcome == "ok" for e in items)
    assert not shown(items), shown(items)


@pytest.mark.slow
def test_a_longer_campaign_finds_nothing(tmp_path):
    done = run_campaign(tmp_path, "--files", 2000, "--meshes", 100, "--kills", 30, "--seed", 2)
    assert done.returncode == 0, shown(entries_of(tmp_path))


def test_the_same_seed_makes_the_same_cases(tmp_path):
    def cases(seed):
        made = parts(seed, Targets(40, 3, 20), folder=tmp_path)
        return [[part.key(case) for case in part.cases] for part in made], [
            kills.kill_case(seed, k) for k in range(20)
        ]

    assert cases(3) == cases(3)
    assert cases(3)[1] != cases(4)[1]
    assert campaign.file_case(3, 5) == campaign.file_case(3, 5)
    assert campaign.file_case(3, 5) != campaign.file_case(4, 5)


def counting(tmp_path, faulty=()):
    """A part whose cases leave a file behind each time they are done."""

    def judge(case):
        with (tmp_path / "done").open("a") as file:
            file.write(f"{case}\n")
        return {"outcome": "ok", "fault": "planted" if case in faulty else None, "detail": ""}

    return Part(
        name="numbers",
        cases=list(range(30)),
        key=str,
        family=lambda case: "odd" if case % 2 else "even",
        judge=judge,
        keep=lambda case, place: (place / "case.txt").write_text(str(case)),
        limits=Limits(),
        batch=4,
    )


pytestmark = pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")


def test_what_was_done_is_not_done_again(tmp_path):
    part, out = counting(tmp_path), tmp_path / "out"
    journal = Journal(out, ABOUT)
    for case in range(10):
        journal.add(Entry("numbers", str(case), "even", "ok"))
    path = out / "journal.jsonl"
    path.write_bytes(path.read_bytes() + b'{"part": "numbers", "case": "1')  # killed here
    journal = Journal(out, ABOUT)
    assert campaign.run([part], journal, 2, float("inf"), lambda entry: None)
    assert sorted(map(int, (tmp_path / "done").read_text().split())) == list(range(10, 30))
    assert {e.case for e in Journal(out, ABOUT).entries} == {str(k) for k in range(30)}


def test_time_that_is_over_ends_a_campaign_and_loses_nothing(tmp_path):
    part, journal = counting(tmp_path), Journal(tmp_path / "out", ABOUT)
    assert not campaign.run([part], journal, 2, float("-inf"), lambda entry: None)
    assert not journal.entries
    assert campaign.run([part], journal, 2, float("inf"), lambda entry: None)


def test_a_faulty_case_is_kept_with_its_command(tmp_path):
    journal = Journal(tmp_path / "out", ABOUT)
    campaign.run([counting(tmp_path, (7,))], journal, 1, float("inf"), lambda entry: None)
    assert (tmp_path / "out/faults/numbers-7/case.txt").read_text() == "7"
    about = (tmp_path / "out/faults/numbers-7/about.txt").read_text()
    assert "--seed 1 --replay numbers:7" in about
    assert len(list((tmp_path / "out/faults").iterdir())) == 1


def test_a_folder_with_another_campaign_is_refused(tmp_path):
    Journal(tmp_path, ABOUT)
    with pytest.raises(WrongFolder, match="another campaign"):
        Journal(tmp_path, {**ABOUT, "seed": 2})


def test_a_replayed_case_ends_as_in_the_campaign(short_campaign, tried):
    case = next(e for e in tried if e.id == "meshes:4/cem")
    done = run_campaign(short_campaign, "--replay", case.id)
    assert done.stdout.startswith(f"{case.outcome}: {case.fault}")
    assert done.returncode == int(case.fault is not None)
    assert len(entries_of(short_campaign)) == len(tried)


def test_the_page_holds_every_count(tmp_path):
    entries = [
        Entry("files", "0", "OBJ", "mesh"),
        Entry("files", "1", "OBJ", "refused"),
        Entry("files", "2", "OFF", "mesh", "silent loss", "a face"),
        Entry("meshes", "0/cem", "slivers", "ok"),
    ]
    summary.write_page(tmp_path / "page.md", entries, ABOUT)
    page = (tmp_path / "page.md").read_text()
    for line in (
        "**4 cases, 1 faults.**",
        "| OBJ | 1 | 1 | 0 |",
        "| all | 2 | 1 | 1 |",
        "| cem | 1 | 0 |",
        "| files | OFF | silent loss | 1 | `files:2` |",
    ):
        assert line in page, page


def test_a_failure_of_the_instrument_is_a_fault_too(tmp_path):
    ending = Ending(5, None, "instrument", "Traceback", 0.1)
    entry = campaign.entry_of(counting(tmp_path), ending)
    assert (entry.outcome, entry.fault) == ("instrument", "instrument")
    assert json.dumps(entry.detail)

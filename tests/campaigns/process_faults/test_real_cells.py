"""Real sessions: a killed control is lowered, a killed guard leaves the drives to brake, a dead recorder is replaced.

A computer that is too busy stops such a session before its strike. The test is skipped then: it has proved nothing.
"""

import contextlib
import os
import signal
import threading
from pathlib import Path

import pytest
from tests.waiting import wait_until

from exograv.campaigns.process_faults.campaign import MatrixCampaign, fly_sessions, prepared_ground
from exograv.campaigns.process_faults.cell import Cell
from exograv.campaigns.process_faults.judge import CellVerdict
from exograv.campaigns.process_faults.notes import read_notes
from exograv.campaigns.process_faults.watching import left_memory, memory_of, processes_of

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> MatrixCampaign:
    return MatrixCampaign(out=tmp_path_factory.mktemp("process_faults"), resume=True)


@pytest.mark.parametrize(
    ("name", "seen"),
    [
        ("control:kill:floating", "lowered"),
        ("guard:kill:floating", "braked"),
        ("guard:exception:floating:python", "lowered"),
        ("recorder:kill:descending", "lowered"),
    ],
)
def test_a_killed_process_of_a_real_session_is_as_expected(
    name: str, seen: str, campaign: MatrixCampaign, tmp_path: Path
):
    ground, machine = prepared_ground(campaign, lambda *_: None)
    verdicts = list[CellVerdict]()
    fly_sessions(campaign, [(Cell.of(name),)], ground, machine, tmp_path, verdicts.append)
    (verdict,) = verdicts
    if verdict.status == "not flown":
        pytest.skip(f"{verdict.faults[0]}, {verdict.tries} times")
    assert (verdict.status, verdict.seen) == ("as expected", seen), verdict.faults


def test_ctrl_c_in_the_middle_of_a_session_leaves_no_process_and_no_shared_memory(
    campaign: MatrixCampaign, tmp_path: Path
):
    ground, machine = prepared_ground(campaign, lambda *_: None)
    place, seen = tmp_path / "recorder_kill_floating_1", set[str]()

    def interrupt() -> None:
        with contextlib.suppress(AssertionError):
            wait_until(lambda: {"guard", "recorder"} <= started(place), "the guard", 60.0)
        seen.update(memory_of(list(processes_of(place / "orders.json"))))
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        fly_sessions(campaign, [(Cell.of("recorder:kill:floating"),)], ground, machine, tmp_path, print)
    thread.join()
    assert started(place) >= {"guard", "recorder"}
    assert list(processes_of(place / "orders.json")) == []
    assert seen
    assert left_memory(seen) == []


def started(place: Path) -> set[str]:
    return {note["name"] for note in read_notes(place) if note["kind"] == "process"}

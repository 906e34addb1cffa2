"""Real sessions: a killed control is lowered, a killed guard leaves the drives to brake, a dead recorder is replaced.

A computer that is too busy stops such a session before its strike. The test is skipped then: it has proved nothing.
"""

from pathlib import Path

import pytest

from exograv.campaigns.process_faults.campaign import MatrixCampaign, flown_cell, prepared_ground
from exograv.campaigns.process_faults.cell import Cell

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> MatrixCampaign:
    return MatrixCampaign(out=tmp_path_factory.mktemp("process_faults"), resume=True)


@pytest.mark.parametrize(
    ("name", "seen"),
    [
        ("control:kill:floating", "lowered"),
        ("guard:kill:floating", "braked"),
        ("recorder:kill:descending", "lowered"),
    ],
)
def test_a_killed_process_of_a_real_session_is_as_expected(
    name: str, seen: str, campaign: MatrixCampaign, tmp_path: Path
):
    ground, machine = prepared_ground(campaign, lambda *_: None)
    verdict = flown_cell(campaign, Cell.of(name), ground, machine, tmp_path)
    if verdict.status == "not flown":
        pytest.skip(f"{verdict.faults[0]}, {verdict.tries} times")
    assert (verdict.status, verdict.seen) == ("as expected", seen), verdict.faults

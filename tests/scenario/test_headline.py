"""The headline figures hold: what a small fixed battery of wearers leaves over, and how many intervals hold the truth.

The battery is small, so that a server flies it each time. Its bounds lie near the figures of this version;
docs/results has the figures of many wearers.
"""

import json
from pathlib import Path

import pytest
from tests.preloaded import script

from .headline_wearers import Headline

WEARERS = Path(__file__).with_name("headline_wearers.py")


def headline(folder: Path, world: str, wearers: int) -> Headline:
    return Headline(*json.loads(script(WEARERS, world, str(wearers), folder=folder).stdout))


@pytest.mark.long
def test_three_home_wearers_are_within_the_target_and_their_intervals_hold(tmp_path: Path):
    found = headline(tmp_path, "home", 3)
    assert found.shoulder_Nm < 0.2
    assert found.elbow_Nm < 0.1
    assert found.parameters > 0.85
    assert found.torque > 0.85


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "shoulder_Nm", "elbow_Nm"), [("tissue", 0.2, 0.1), ("shoulder", 0.4, 0.25), ("cuffs", 0.3, 0.12)]
)
def test_a_foreign_world_leaves_no_more_over_than_today(
    tmp_path: Path, world: str, shoulder_Nm: float, elbow_Nm: float
):
    """Shoulder and cuffs miss the targets (docs/results/results.md)."""
    found = headline(tmp_path, world, 6)
    assert found.parameters > 0.8
    assert found.shoulder_Nm < shoulder_Nm
    assert found.elbow_Nm < elbow_Nm

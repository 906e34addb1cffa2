"""Recordings of the present commands are decided the same in a replay, to the last bit."""

from collections.abc import Callable
from pathlib import Path

import pytest

from exograv.api.rig_factory import run_live
from exograv.cli.recordings.replaying import run_replay
from exograv.live.options import LiveOptions
from exograv.results import json_value

from .conftest import SEED, Demo


def same(path: Path) -> None:
    found = json_value(run_replay(path, None, lambda _text, _share: None))
    assert found["bit_identical"] == {"tau_desired": True, "tau_commanded": True}
    assert found["first_difference"] is None
    assert found["safe_state_differs"]["ticks"] == 0
    assert found["compared"]["tau_commanded"] == found["ticks"]
    assert found["circumstances"] == []


@pytest.mark.slow
def test_a_demonstration_is_decided_the_same(demo: Demo):
    same(demo.recording)


@pytest.mark.slow
def test_a_demonstration_on_the_other_side_and_another_planet_is_decided_the_same(run_demo: Callable[..., Demo]):
    same(run_demo("demo", "--side", "left", "--seconds", "10", "--gravity-level", "0.378").recording)


@pytest.mark.slow
def test_a_live_run_is_decided_the_same(tmp_path: Path):
    run_live(LiveOptions(seed=SEED, seconds=8.0), tmp_path, lambda _text, _share: None)
    same(tmp_path / "live.mcap")

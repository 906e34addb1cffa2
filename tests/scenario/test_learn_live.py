"""An arm that is identified live floats as well as one identified before, even if its worker is killed meanwhile."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exograv.api.rig_factory import run_live
from exograv.cli.recordings.replaying import run_replay
from exograv.errors import ConfigError
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.preparation import Preparation
from exograv.live.live_figures import LiveFigures
from exograv.live.live_processes import Running
from exograv.live.options import LiveOptions
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.recording import read_recording
from exograv.results import json_value

SEED = 1004
RESIDUAL_NM, RESIDUAL_S = 0.1, 0.1  # Values of a perfectly calibrated machine.
SHOULDER_NM, ELBOW_NM = 0.5, 0.25
"""Coarse target. Half a minute at level 1 is more than enough for it."""


def known_machine(preparation: Preparation, *_) -> ControllerKnowledge:
    """Knowledge of the machine without a calibration, which is not tested here. The wearer is unknown."""
    laboratory = preparation.laboratory
    prepared = ideal_knowledge(laboratory, 0.0)
    # The table's cuffs are used, as in a session, so that a replay makes the same model.
    assembly = laboratory.assembly()
    joints = np.ones(assembly.n)
    machine = replace(prepared.machine, residual_sd=RESIDUAL_NM * joints, correlation_s=RESIDUAL_S * joints)
    return replace(prepared, assembly=assembly, machine=machine, x=table_guess(assembly, machine))


def learned(folder: Path, strike: signal.Signals) -> LiveFigures:
    """Run whose worker gets a signal in the middle of the motion."""

    def started(running: Running) -> None:
        worker = running.worker
        assert worker is not None
        pid = worker.pid

        def later() -> None:
            time.sleep(20.0)
            os.kill(pid, strike)

        threading.Thread(target=later, daemon=True).start()

    options = LiveOptions(seed=SEED, level=1, seconds=20.0, identify_s=25.0)
    return run_live(options, folder, lambda _text, _share: None, started)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveFigures]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Preparation, "calibrated", known_machine)
        yield learned(tmp_path_factory.mktemp("live"), signal.SIGKILL)


@pytest.mark.slow
def test_a_worker_that_is_killed_is_replaced_and_the_arm_learned_all_the_same(run: LiveFigures):
    assert run.worker_restarts == 1
    assert run.samples_lost == 0
    found = run.identified
    assert found is not None
    assert found.left_over_Nm is not None
    assert found.motion_s == pytest.approx(25.0, abs=0.5)
    *shoulder, elbow = found.left_over_Nm
    assert max(shoulder) < SHOULDER_NM
    assert elbow < ELBOW_NM


@pytest.mark.slow
def test_an_arm_that_is_learned_is_let_go_when_the_guard_knows_it(run: LiveFigures):
    recording = read_recording(run.recording)
    modes = [phase["name"] for phase in recording.messages("/phase")]
    known = [event["t"] for event in recording.messages("/event") if "knows the person" in event["text"]]
    floating = [phase["t"] for phase in recording.messages("/phase") if phase["name"] == "floating"]
    assert modes[:5] == ["off", "self_test", "exo_only", "ramp_in", "moving"]
    assert len(known) == 1
    assert 0.0 <= floating[0] - known[0] < 0.05


@pytest.mark.slow
def test_a_run_that_learned_live_decides_the_same_when_it_is_flown_again(run: LiveFigures):
    again = json_value(run_replay(run.recording, None, lambda _text, _share: None))
    assert again["bit_identical"] == {"tau_desired": True, "tau_commanded": True}


@pytest.mark.parametrize(
    ("given", "says"), [({"identify_s": 3.0}, "10"), ({"identify_s": 20.0, "gravity_level": 0.5}, "gravity-level")]
)
def test_a_lesson_that_cannot_be_is_refused_before_anything_moves(given: dict[str, float], says: str):
    with pytest.raises(ConfigError, match=says):
        LiveOptions(**given)  # pyright: ignore[reportArgumentType] - one type a row

"""The arm is compared with its identification between windows: a slipped cuff is told and learned again."""

from pathlib import Path

import numpy as np
import pytest
from tests.preloaded import exograv
from tests.scenario.test_train import records, short, trained

from exograv.experiment.train import train_command
from exograv.experiment.train.options import TrainOptions
from exograv.experiment.train.preparation import CheckedBetween, Ready
from exograv.experiment.train.session_check import check_between
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.left_over import TARGET_NM
from exograv.identification.drift.slow_change import Kind
from exograv.laboratory.preparation import Preparation, WornTwin
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import laboratory_at
from exograv.model.description import load_rig
from exograv.procedures.identification.identify import V_MOTION
from exograv.procedures.identification.session_watch import SessionWatch, repeat_motion
from exograv.recording import read_recording
from exograv.rig.twin import Disturbances, Twin

SEED = 1014
"""Figures are reported on other seeds (docs/explanation/disturbances.md)."""

SLIP_M, BETWEEN_S = 0.03, 600.0


@pytest.fixture(scope="module")
def watched() -> tuple[WornTwin, SessionWatch, np.ndarray, np.ndarray]:
    """Worn twin without warm-up whose arm is identified, its watch, and parameters with covariance."""
    disturbances = Disturbances.at_level(2).with_row("warm_up", 0)
    preparation = Preparation(laboratory_at(load_rig("recupera_like"), disturbances, SEED, SEED), SEED)
    worn = preparation.worn(preparation.calibrated())
    floated = worn.identify(worn.identifier()).floated
    assert floated.covariance is not None
    assert worn.pilot.worn is not None
    worn.pilot.worn.expect(floated.x, floated.covariance, V_MOTION)
    before = repeat_motion(worn.pilot, worn.controller)
    model = ArmModel(worn.known.assembly, worn.known.machine)
    return worn, SessionWatch(model, floated.x, floated.covariance, before), floated.x, floated.covariance


@pytest.mark.slow
def test_nothing_is_told_in_an_hour_of_a_quiet_session_and_then_a_slipped_cuff_is(watched):
    worn, watch, x, _ = watched
    for _ in range(6):
        worn.twin.pass_time(BETWEEN_S)
        assert watch.judge(repeat_motion(worn.pilot, worn.controller)).is_silent
    examination = worn.examination()
    worn.twin.slide_cuff("forearm", SLIP_M)
    examination.slide_cuff("forearm", SLIP_M)
    samples = repeat_motion(worn.pilot, worn.controller)
    judgement = watch.judge(samples)
    assert [(one.cause.kind, one.cause.place) for one in judgement.changes] == [(Kind.CUFF, "forearm")]
    assert abs(judgement.changes[0].size - SLIP_M) <= judgement.changes[0].half_width
    learned = watch.learn_again(samples, judgement)
    after = Examination(worn.laboratory, learned.assembly, worn.known.machine)
    after.slide_cuff("forearm", SLIP_M)
    targets = np.array([TARGET_NM[place] for place in worn.known.assembly.description.places])
    slipped, again = (one.score(arm).total for one, arm in ((examination, x), (after, learned.carried.x)))
    assert (again / targets).max() < 0.5 * (slipped / targets).max()
    assert watch.judge(samples).is_silent


@pytest.mark.slow
def test_a_session_with_checks_records_each_and_runs_all_windows(tmp_path: Path):
    result = trained(tmp_path, "--protocol", str(short(tmp_path)), "--check-every", "1", "--identify-again")
    assert result["is_complete"]
    recording = read_recording(Path(result["recording"]))
    told = [event for event in recording.messages("/event") if event["kind"] == "session check"]
    assert [event["text"] for event in told] == [one["why"] for one in result["checked"]]
    assert len(told) == 1
    assert [one["why"] for one in records(recording, "paused")] == ["session check"]


@pytest.mark.slow
def test_a_cuff_that_slips_in_a_session_is_carried_from_then_on_and_the_recording_replays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def slipped(ready: Ready, after_windows: int, learns_again: bool) -> CheckedBetween:
        assert isinstance(ready.pilot.rig, Twin)
        ready.pilot.rig.slide_cuff("forearm", SLIP_M)
        return check_between(ready, after_windows, learns_again)

    monkeypatch.setattr(train_command, "check_between", slipped)
    protocol = str(short(tmp_path, base="training", rest_s=14.0))
    options = TrainOptions(participant="P-07", seed=SEED, protocol=protocol, check_every=1, identify_again=True)
    result = train_command.run_training(options, tmp_path, lambda _text, _share: None)
    (checked,) = result.preparation.checked or []
    assert (checked.changes[0].kind, checked.changes[0].place) == ("cuff", "forearm")
    assert checked.learned_again
    assert result.is_complete
    controls = read_recording(result.recording).messages("/control")
    (slid,) = [message["slid_m"] for message in controls if message.get("slid_m")]
    assert slid == pytest.approx([0.0, checked.changes[0].size], abs=1e-4)
    exograv("data", "replay", str(result.recording), check=True)

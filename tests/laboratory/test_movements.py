"""Movements end where they started, stay within reach, and recorded ones agree with the recordings."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from exograv.errors import RecordingError
from exograv.laboratory.movements import LIMIT_MARGIN, pointing, recorded
from exograv.laboratory.recorded_reaching import arm_angles, reaching_folder, read_reaching, smooth_path
from exograv.model.description import load_rig

DT = 1e-3
LOWER, UPPER = np.array([-0.7, -0.3, -1.3, 0.0]), np.array([2.3, 1.31, 1.3, 2.18])
ANGLE_STEP = np.deg2rad(0.03)  # Resolution of the recordings' encoders.


@pytest.fixture(scope="module")
def folder() -> Path:
    try:
        return reaching_folder()
    except RecordingError as error:
        pytest.skip(str(error))


def test_eight_touches_take_22_seconds():
    movement = pointing(4, DT)
    assert movement.repeats == 8
    assert movement.repeats * movement.path.seconds == pytest.approx(22.0)


@pytest.mark.parametrize("freedoms", [4, 7])
def test_pointing_ends_at_rest_where_it_began(freedoms: int):
    path = pointing(freedoms, DT).path
    assert path.q.shape == (2750, freedoms)
    np.testing.assert_allclose(path.q[-1], path.q[0], atol=1e-9)
    np.testing.assert_allclose(path.v[[0, -1]], 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["recupera_like", "recupera_like_qdd"])
def test_pointing_stays_in_the_task_workspace(name: str):
    lower, upper = load_rig(name).workspace
    q = pointing(4, DT).path.q
    assert (q >= lower - 1e-9).all()
    assert (q <= upper + 1e-9).all()


@pytest.mark.parametrize(("joint", "freedom", "sign"), [(0, 1, -1.0), (1, 0, -1.0), (2, 2, -1.0), (3, 3, 1.0)])
def test_a_single_joint_of_the_recordings_is_a_single_freedom_of_ours(joint: int, freedom: int, sign: float):
    exo, ours = np.zeros((1, 4)), np.zeros((1, 4))
    exo[0, joint], ours[0, freedom] = 0.5, 0.5 * sign
    np.testing.assert_allclose(arm_angles(exo), ours, atol=1e-12)


def test_both_orders_of_turning_lead_to_the_same_upper_arm():
    exo = np.random.default_rng(1).uniform([-1.2, -1.2, -1.0, 0.0], [0.0, 0.0, 0.5, 2.0], (50, 4))
    flexion, abduction, rotation, _ = arm_angles(exo).T
    ours = Rotation.from_euler("YXZ", np.column_stack([-flexion, -abduction, rotation]))
    theirs = Rotation.from_euler("XYZ", exo[:, :3] * [1.0, 1.0, -1.0])
    np.testing.assert_allclose((ours.inv() * theirs).magnitude(), 0.0, atol=1e-7)


def test_smoothing_takes_the_steps_of_the_encoder_and_no_more():
    t = np.arange(300) / 100.0
    slow = np.column_stack([np.sin(2.0 * t + k) for k in range(4)])
    path = smooth_path(np.round(slow / ANGLE_STEP) * ANGLE_STEP, DT)
    np.testing.assert_allclose(path.q[500:2400:10], slow[50:240], atol=3.0 * ANGLE_STEP)
    np.testing.assert_allclose(path.v[500:2400], np.gradient(path.q, DT, axis=0)[500:2400], atol=1e-3)


def test_what_is_no_recording_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match="has no repetition 1 of task 2"):
        read_reaching(tmp_path / "none.mat", 2)
    cells, segments = np.empty((1, 1), dtype=object), np.empty((2, 1), dtype=object)
    segments[:, 0] = [np.zeros((3, 20)), np.zeros((3, 30))]
    cells[0, 0] = segments
    savemat(tmp_path / "three.mat", {"tasks": cells})
    with pytest.raises(RecordingError, match="4 × N"):
        read_reaching(tmp_path / "three.mat", 1)


def test_missing_recordings_are_named_with_the_way_to_get_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("EXOGRAV_DATA", str(tmp_path))
    with pytest.raises(RecordingError, match="HuG-MP"):
        reaching_folder()


def test_recorded_reaching_comes_back_and_stays_within_reach(folder: Path):
    movement = recorded(LOWER, UPPER, DT, folder)
    path = movement.path
    np.testing.assert_allclose(path.q[-1], path.q[0], atol=1e-9)
    overshoot = np.deg2rad(0.5)  # Smoothing rounds the corners of clipped samples.
    assert (path.q >= LOWER + LIMIT_MARGIN - overshoot).all()
    assert (path.q <= UPPER - LIMIT_MARGIN + overshoot).all()
    assert np.abs(path.v).max() < 4.0
    assert np.abs(np.diff(path.q, axis=0)).max() < 5e-3


def test_recorded_samples_beyond_reach_are_counted(folder: Path):
    wide = recorded(LOWER - 3.0, UPPER + 3.0, DT, folder)
    narrow = recorded(LOWER, UPPER, DT, folder)
    assert wide.clipped == 0 < narrow.clipped < narrow.samples == wide.samples

"""The demonstration finds hidden gains, a hidden arm and a hidden weight. The controller has no access to the truth."""

import numpy as np
import pytest

from exograv.model.description import load_rig
from exograv.recording import read_recording

GAIN = 0.02  # Relative error.
COULOMB_NM = 0.3
DRIFT_DEG = 5.0
FREEDOMS = ("flexion", "abduction", "rotation", "elbow")
NEVER_THE_SAME = ("wall_s", "tick_us", "report", "recording")


def calibration(demo, name: str) -> tuple[np.ndarray, np.ndarray]:
    """True and calibrated values, one entry per joint."""
    rows = [row for row in demo.result["calibration"] if row["name"] == name]
    return np.array([row["truth"] for row in rows]), np.array([row["estimate"] for row in rows])


def test_stage_0_finds_the_hidden_torque_gains(demo):
    truth, found = calibration(demo, "gain")
    assert (np.abs(found / truth - 1.0) < GAIN).all()


def test_stage_0_finds_the_hidden_friction(demo):
    truth, found = calibration(demo, "coulomb")
    assert (np.abs(found - truth) < COULOMB_NM).all()


def test_the_identified_arm_leaves_less_over_than_the_table_and_half_of_it_at_the_shoulder(demo):
    total = demo.result["left_over_rms_Nm"]["total"]
    exo_only, table, identified = (np.array(total[name]) for name in ("exo_only", "table", "identified"))
    assert identified.sum() < table.sum() < exo_only.sum()
    assert identified[0] < 0.5 * table[0]


def test_a_hidden_weight_in_the_hand_is_found(demo):
    weight = demo.result["known_weight"]
    error = abs(weight["estimated_kg"] - weight["true_kg"])
    low, high = weight["ci95_kg"]
    assert error <= max(0.05 * weight["true_kg"], 0.030) or low <= weight["true_kg"] <= high


def test_the_weight_that_was_found_is_carried(demo):
    left_over = demo.result["known_weight"]["left_over_Nm"]
    assert left_over["compensated"][0] < 0.2 * left_over["ignored"][0]


def test_the_floated_arm_stays_or_is_drawn_towards_its_own_rest(demo):
    """Friction is returned.

    Its remainder may be less than the pull of the wearer's passive joints, as in weightlessness.
    """
    floated, truth = demo.result["float"], {row["name"]: row["truth"] for row in demo.result["parameters"]}
    rest = np.array([truth[f"{name}.spring_offset"] / truth[f"{name}.stiffness"] for name in FREEDOMS])
    way = np.abs(np.rad2deg(rest - np.mean(load_rig("recupera_like").workspace, axis=0)))
    assert floated["window_s"] == 10.0
    assert (np.array(floated["drift_deg"]) < way + DRIFT_DEG).all()
    assert np.median(floated["drift_deg"]) < DRIFT_DEG


def test_most_stated_intervals_hold_the_truth(demo):
    rows = demo.result["parameters"]
    inside = [row["ci95"][0] <= row["truth"] <= row["ci95"][1] for row in rows]
    # One wearer proves no coverage, which is counted over many (benchmarks/). A large error is a fault nevertheless.
    assert np.mean(inside) > 0.7


def test_the_recording_of_a_default_demo_takes_at_most_40_MB(demo):
    """The common demo has 30 s of motion, the default one 60 s."""
    size, ticks = demo.recording.stat().st_size, len(read_recording(demo.recording).ticks)
    assert size * (1.0 + 30_000 / ticks) < 40e6


def test_no_torque_leaves_the_envelope(demo):
    recording = read_recording(demo.recording)
    limits, ticks = recording.settings["limits"], recording.ticks
    tau = ticks["tau_commanded"].astype(float)
    assert np.isfinite(tau).all()
    assert (np.abs(tau) <= np.array(limits["torque_max_Nm"]) + 1e-5).all()
    assert np.abs(ticks["v"]).max() < limits["v_trip_rad_s"]
    # Calibration and worn machine have separate envelopes. The second starts with the arm carried.
    worn = int(np.searchsorted(ticks["t"], recording.messages("/phase")[1]["t"] - 1e-6))
    rate = np.abs(np.diff(tau, axis=0)) / 1e-3
    assert np.delete(rate, worn - 1, axis=0).max() <= limits["torque_rate_max_Nm_per_s"] * 1.001


def test_the_loops_stay_closed_from_beginning_to_end(demo):
    assert read_recording(demo.recording).ticks["closure_slope"].max() < 1e-3


def test_nothing_jumps_when_one_phase_follows_another(demo):
    recording = read_recording(demo.recording)
    ticks = recording.ticks
    for phase in recording.messages("/phase")[2:]:  # Phases after the wearer is in the machine.
        k = int(np.searchsorted(ticks["t"], phase["t"] - 1e-6))
        step = np.abs(ticks["tau_desired"][k].astype(float) - ticks["tau_desired"][k - 1]).max()
        assert step < 4.0, phase["name"]  # The weak PD releases at most 2-3° of stiction.


@pytest.mark.slow
def test_the_same_seed_gives_the_same_result(run_demo):
    words = ("identify", "--seconds", "6")
    first, second = (run_demo(*words).result for _ in range(2))
    for name in NEVER_THE_SAME:
        del first[name], second[name]
    assert first == second


@pytest.mark.slow
def test_the_left_arm_works_like_the_right_one(run_demo):
    result = run_demo("identify", "--seconds", "30", "--side", "left").result
    total = result["left_over_rms_Nm"]["total"]
    assert sum(total["identified"]) < 0.7 * sum(total["table"]) < 0.7 * sum(total["exo_only"])


@pytest.mark.slow
@pytest.mark.parametrize("method", ["gradient", "anthropometric"])
def test_every_method_goes_through_the_whole_demonstration(run_demo, method: str):
    result = run_demo("demo", "--seconds", "5", "--method", method).result
    assert result["method"] == method
    # The drift is not promised for these methods: friction is returned, and no longer hides the residual torque.
    assert result["float"]["window_s"] > 0.0
    assert result["known_weight"]["estimated_kg"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("gravity_level", ["0.378", "1"])
def test_the_arm_can_be_floated_heavier_and_weighed_all_the_same(run_demo, gravity_level: str):
    words = ("--seconds", "8", "--gravity-level", gravity_level)
    weight = run_demo("demo", *words).result["known_weight"]
    assert weight["ci95_kg"][0] - 0.03 <= weight["true_kg"] <= weight["ci95_kg"][1] + 0.03

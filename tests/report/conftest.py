"""Made-up recording in the form of `exograv demo`: no rig, no controller, no true values in its numbers."""

from pathlib import Path

import numpy as np
import pytest

from exograv.recording import RecordingWriter

JOINTS = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
SEGMENTS = ("upper_arm", "forearm")
QUANTITIES = (("mass", "kg"), ("mx", "kg·m"), ("my", "kg·m"), ("mz", "kg·m"), ("Ixx", "kg·m²"), ("Izz", "kg·m²"))
IDENTIFY_S, FLOAT_S = 30.0, 5.0
SETTINGS = {
    "rig": "recupera_like",
    "title": "Recupera-like arm, harmonic drives, passive forearm",
    "side": "right",
    "command": "exograv demo --seed 3",
    "method": "recursive",
    "torque_source": "motor current",
    "disturbance_level": 2,
    "seed": 3,
    "gravity_level": 0.0,
    "wearer": {"height_m": 1.78, "mass_kg": 80.0, "sex": "male"},
    "limits": {"torque_max_Nm": [60.0, 60.0, 30.0, 30.0], "torque_rate_max_Nm_per_s": 150.0},
    "hashes": {"rig": "0f" * 32},
    "versions": {"exograv": "0.1.0"},
}
RESULT = {
    "left_over_rms_Nm": {
        "total": {
            "exo_only": [5.81, 4.12, 1.73, 2.41],
            "table": [0.92, 0.71, 0.38, 0.44],
            "identified": [0.16, 0.14, 0.18, 0.07],
        },
        "arm": {"table": [0.85, 0.66, 0.31, 0.40], "identified": [0.09, 0.08, 0.05, 0.04]},
    },
    "identification": {
        "motion_s": 30.0,
        "time_to_target_s": 21.5,
        "stop": "precise",
        "outcome": "The arm is identified.",
    },
    "known_weight": {"true_kg": 1.0, "estimated_kg": 1.012, "ci95_kg": [0.97, 1.05]},
    "float": {"gravity_level": 0.0, "drift_deg": [0.4, -0.2, 0.9, 0.1], "window_s": 5.0},
    "comparison": {
        "text": "This run against 3 other simulated wearers.",
        "others_Nm": [[0.1, 0.1, 0.1, 0.1], [0.2, 0.2, 0.2, 0.2], [0.3, 0.3, 0.3, 0.3]],
        "lower": [1, 1, 1, 0],
        "reached": 1,
        "date": "2026-01-01",
    },
    "simulated_s": 35.0,
}


def parameter_entries(seconds: float, rng: np.random.Generator) -> list[dict]:
    """Return estimates that converge with time."""
    entries = []
    for k, (segment, (name, unit)) in enumerate((s, q) for s in SEGMENTS for q in QUANTITIES):
        prior, truth, spread = 1.0 + 0.3 * k, 1.1 + 0.28 * k, 0.3 / np.sqrt(1.0 + seconds)
        estimate = truth + 0.3 * spread * np.sin(k + 0.2 * seconds) + 0.02 * spread * rng.normal()
        interval = [estimate - spread, estimate + spread]
        entry = {"name": f"{segment}.{name}", "unit": unit, "prior": prior, "estimate": estimate, "ci95": interval}
        entries.append(entry)
    return entries


def skeleton(q: np.ndarray) -> dict[str, list]:
    """Return points of an arm that flexes and abducts, with its elbow in front."""
    shoulder = np.array([0.0, -0.19, 0.0])
    upper = np.array([np.sin(q[0]) * np.cos(q[1]), -np.sin(q[1]), -np.cos(q[0]) * np.cos(q[1])])
    reach = q[0] + q[3]
    lower = np.array([np.sin(reach) * np.cos(q[1]), -np.sin(q[1]), -np.cos(reach) * np.cos(q[1])])
    elbow, hand = shoulder + 0.29 * upper, shoulder + 0.29 * upper + 0.40 * lower
    base, offset = np.array([-0.18, -0.19, 0.12]), np.array([0.02, -0.05, 0.01])
    return {
        "exo": [base, base + np.array([0.18, 0.0, -0.1]), elbow + offset, hand - 0.1 * lower + offset],
        "arm": [shoulder, elbow, hand],
    }


def write_demo(path: Path, seed: int = 3) -> Path:
    """Return a short recording of a whole session."""
    rng = np.random.default_rng(seed)
    with RecordingWriter(path, JOINTS, SETTINGS) as recording:
        recording.phase(0.0, "identify")
        for k in range(int(1000 * IDENTIFY_S)):
            t = 1e-3 * k
            _write_identification_tick(recording, t, rng)
            if k % 200 == 0:
                message = {
                    "motion_s": t,
                    "parameters": parameter_entries(t, rng),
                    "outcome": "The arm is not yet known well enough.",
                }
                recording.write("/estimate", t, {**message, "predicted_left_over_Nm": np.full(4, 1.0 / (1.0 + t))})
            if k % 1500 == 0:
                left = 0.8 * np.exp(-t / 6.0) * np.array([1.0, 0.8, 0.5, 0.4]) + [0.12, 0.1, 0.14, 0.05]
                recording.write("/left_over", t, {"motion_s": t, "total": left, "arm": 0.6 * left})
        recording.phase(IDENTIFY_S, "float")
        recording.write("/event", IDENTIFY_S, {"kind": "note", "text": "The arm is let go."})
        for k in range(int(1000 * FLOAT_S)):
            _write_float_tick(recording, IDENTIFY_S + 1e-3 * k, 1e-3 * k, rng)
        truths = [dict(entry, truth=1.1 + 0.28 * k) for k, entry in enumerate(parameter_entries(IDENTIFY_S, rng))]
        recording.write(
            "/result", IDENTIFY_S + FLOAT_S, {**RESULT, "parameters": truths, "calibration": _calibration()}
        )
    return path


def _write_identification_tick(recording: RecordingWriter, t: float, rng: np.random.Generator) -> None:
    q = np.array([0.8, 0.3, 0.1, 1.2]) + 0.5 * np.sin(t * np.array([0.61, 0.43, 0.83, 0.71]) + [0, 1, 2, 3])
    tau = np.array([9.0, 5.0, 1.0, 4.0]) * np.sin(q)
    noisy = tau + 0.4 * rng.normal(size=4)
    values = {"q_measured": q, "q_reference": q, "v": 0.3 * np.cos(t) * np.ones(4), "current": noisy / 6.75}
    torques = {"tau_measured": noisy, "tau_feedforward": tau, "tau_desired": tau, "tau_commanded": tau}
    recording.tick(t, closure_slope=1e-9, tick_us=60.0 * np.exp(0.15 * rng.normal()), **values, **torques)
    if round(1000 * t) % 50 == 0:
        recording.write("/skeleton", t, skeleton(q))


def _write_float_tick(recording: RecordingWriter, t: float, since: float, rng: np.random.Generator) -> None:
    q = np.array([1.0, 0.3, 0.0, 1.2]) + np.deg2rad([0.4, -0.2, 0.9, 0.1]) * (1.0 - np.exp(-since))
    still = {
        name: np.zeros(4)
        for name in ("v", "current", "tau_measured", "tau_feedforward", "tau_desired", "tau_commanded")
    }
    tick_us = 60.0 * np.exp(0.15 * rng.normal())
    recording.tick(t, closure_slope=1e-9, tick_us=tick_us, q_measured=q, q_reference=np.full(4, np.nan), **still)


def _calibration() -> list[dict]:
    quantities = (("gain", "N·m/A", 6.7), ("coulomb", "N·m", 2.2), ("viscous", "N·m·s/rad", 1.4))
    return [
        {
            "joint": joint,
            "name": name,
            "unit": unit,
            "truth": 1.01 * value,
            "estimate": value,
            "ci95": [0.97 * value, 1.04 * value],
        }
        for joint in JOINTS
        for name, unit, value in quantities
    ]


@pytest.fixture(scope="session")
def demo_recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of a whole session on disk."""
    return write_demo(tmp_path_factory.mktemp("recording") / "demo.mcap")

"""Recordings of an empty machine are read from MCAP, CSV and ROS alike, divided at gaps, and refused with a reason."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from exograv.errors import ConfigError, RecordingError
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.description import load_rig
from exograv.procedures.machine_twin.options import TwinFitOptions
from exograv.procedures.machine_twin.read_motions import LOWERING_S, read_motions
from exograv.procedures.machine_twin.recorded_columns import hung_row
from exograv.recording import RecordingWriter

RIG = load_rig("recupera_like")
TICKS, PERIOD_S = 3000, 0.001
T = 7.0 + PERIOD_S * np.arange(TICKS)
Q = np.sin(np.outer(T, [1.0, 0.7, 1.3, 0.9]))
CURRENT = 3.0 * np.cos(np.outer(T, [1.1, 0.8, 1.2, 0.6]))
ASKED = np.roll(CURRENT, -2, axis=0)


def write_csv(path: Path, with_commands: bool = True, rows: slice = slice(None), delimiter: str = ",") -> Path:
    groups, values = ["t"], [T[:, None]]
    for stem, columns in (("q", Q), ("tau", CURRENT * RIG.nominal_gain), ("tau_commanded", ASKED * RIG.nominal_gain)):
        if stem != "tau_commanded" or with_commands:
            groups += [f"{stem}_{joint}" for joint in RIG.joints]
            values.append(columns)
    table = np.hstack(values)[rows]
    np.savetxt(path, table, delimiter=delimiter, header=delimiter.join(groups), comments="")
    return path


def read(*paths: Path, **weights: tuple[str, float]) -> tuple[MeasuredMotion, ...]:
    recordings = read_motions(RIG, paths, weights, is_torque=True)
    return tuple(motion for recording in recordings for motion in recording.motions)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_a_csv_is_read_by_the_names_of_its_columns(tmp_path: Path, delimiter: str):
    (motion,) = read(write_csv(tmp_path / "a.csv", delimiter=delimiter))
    np.testing.assert_allclose(motion.q, Q, atol=1e-12)
    np.testing.assert_allclose(motion.current, CURRENT, atol=1e-9)
    np.testing.assert_allclose(motion.current_asked, ASKED, atol=1e-9)
    assert motion.period_s == pytest.approx(PERIOD_S)


def test_a_csv_without_commands_has_none(tmp_path: Path):
    (motion,) = read(write_csv(tmp_path / "a.csv", with_commands=False))
    assert np.isnan(motion.current_asked).all()


def test_temperatures_of_a_csv_are_optional(tmp_path: Path):
    path = write_csv(tmp_path / "a.csv")
    (motion,) = read(path)
    assert motion.temperature is None
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    head += "".join(f",temperature_{joint}" for joint in RIG.joints)
    warm = [f"{row},{25.0 + 0.01 * k},26,27,28" for k, row in enumerate(rows)]
    path.write_text("\n".join([head, *warm]) + "\n", encoding="utf-8")
    (motion,) = read(path)
    assert motion.temperature is not None
    np.testing.assert_allclose(
        motion.temperature[[0, -1]], [[25.0, 26, 27, 28], [25.0 + 0.01 * (TICKS - 1), 26, 27, 28]]
    )


def test_temperatures_of_a_calibration_are_those_of_its_events(tmp_path: Path):
    (motion,) = read(ours(tmp_path / "a.mcap"))
    assert motion.temperature is None
    (motion,) = read(ours(tmp_path / "b.mcap", warmth=("25.0 25.0 30.0 nan", "27.0 25.0 31.0 nan")))
    assert motion.temperature is not None
    np.testing.assert_allclose(motion.temperature[[0, 750, -1], 0], [25.0, 26.0, 27.0], atol=0.01)
    assert np.isnan(motion.temperature[:, 3]).all()


def test_a_gap_divides_a_recording_and_short_pieces_are_left_out(tmp_path: Path):
    rows = np.r_[0:2500, 2600:3000]
    (motion,) = read(write_csv(tmp_path / "a.csv", rows=rows))  # pyright: ignore[reportArgumentType]
    assert len(motion.t) == 2500


def test_uneven_time_is_put_on_an_even_grid(tmp_path: Path):
    shaken = T + 2e-4 * np.sin(np.arange(TICKS))
    path = write_csv(tmp_path / "a.csv")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[:, 0], table[:, 1:5] = shaken, np.sin(np.outer(shaken, [1.0, 0.7, 1.3, 0.9]))
    np.savetxt(path, table, delimiter=",", header=path.read_text().splitlines()[0], comments="")
    (motion,) = read(path)
    np.testing.assert_allclose(np.diff(motion.t, 2), 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.q, np.sin(np.outer(motion.t, [1.0, 0.7, 1.3, 0.9])), atol=1e-6)


def test_a_weight_is_stated_for_a_whole_recording(tmp_path: Path):
    path = write_csv(tmp_path / "a.csv")
    options = TwinFitOptions("recupera_like", (path,), weights=(f"{path}:calibration_mount=3",))
    (motion,) = (one for r in read_motions(RIG, [path], options.weight_of_file(), is_torque=False) for one in r.motions)
    weights = np.array(RIG.calibration.weights_kg)
    np.testing.assert_allclose(motion.hung @ weights, 3.0)


def test_a_wrong_weight_is_refused_with_the_right_form(tmp_path: Path):
    path = write_csv(tmp_path / "a.csv")
    with pytest.raises(ConfigError, match="give FILE:MOUNT=KG, such as"):
        TwinFitOptions("recupera_like", (path,), weights=("a.csv=3",)).weight_of_file()
    with pytest.raises(ConfigError, match=r"No mount 'hook' in .*Mounts: calibration_mount"):
        hung_row(RIG, "hook", 1.0)
    with pytest.raises(ConfigError, match=r"--weight names 'b.csv', which is none of the recordings"):
        read_motions(RIG, [path], {"b.csv": ("calibration_mount", 1.0)}, is_torque=False)


def ours(
    path: Path,
    joints: tuple[str, ...] = RIG.joints,
    phase: str = "calibrate",
    warmth: tuple[str, ...] = (),
    worn_from: int = -1,
    wearer: Mapping[str, object] | None = None,
) -> Path:
    """Write a recording of exograv in which a weight hangs from the middle on."""
    person = {} if wearer is None else {"wearer": dict(wearer)}
    with RecordingWriter(path, joints, {"rig": "recupera_like", **person}) as recording:
        recording.phase(float(T[0]), phase)
        for k, t in enumerate(T.tolist()):
            if k == worn_from:
                recording.phase(t, "identify")
            torques = {"tau_measured": 7.0 * CURRENT[k], "tau_commanded": 7.0 * ASKED[k], "tau_desired": 7.0 * ASKED[k]}
            recording.tick(
                t, drive=np.nan, gravity_level=np.nan, arm_share=np.nan, closure_slope=0.0, tick_us=0.0, safe_state=0,
                q_measured=Q[k], q_reference=Q[k], v=0.0, current=CURRENT[k], tau_feedforward=0.0, **torques,
            )  # fmt: skip
        recording.write("/event", float(T[1500]), {"kind": "weight", "text": "1.5 kg at calibration_mount"})
        for tick, text in zip((0, 1500), warmth, strict=False):
            recording.write("/event", float(T[tick]), {"kind": "temperature", "text": text})
    return path


def test_a_recording_of_exograv_states_its_commands_and_weights_itself(tmp_path: Path):
    (motion,) = read(ours(tmp_path / "a.mcap"))
    np.testing.assert_allclose(motion.current, CURRENT)
    # Both torques are converted by the gain of the recording, whatever the data sheet says.
    np.testing.assert_allclose(motion.current_asked, ASKED, rtol=1e-6)
    kg = motion.hung @ np.array(RIG.calibration.weights_kg)
    np.testing.assert_allclose(kg[1500:], 1.5)
    lowered = round(LOWERING_S / PERIOD_S)
    assert np.isnan(kg[1501 - lowered : 1500]).all()
    assert not kg[: 1499 - lowered].any()


def test_the_time_with_an_arm_in_the_machine_is_left_out_and_told(tmp_path: Path):
    (recording,) = read_motions(RIG, [ours(tmp_path / "a.mcap", worn_from=2200)], {}, is_torque=False)
    assert recording.worn_s == pytest.approx(0.8, abs=0.01)
    assert recording.seconds == pytest.approx(2.2, abs=0.01)
    (recording,) = read_motions(RIG, [ours(tmp_path / "b.mcap")], {}, is_torque=False)
    assert recording.worn_s == 0.0


def test_the_identification_of_an_arm_is_kept_with_the_body_data_of_the_person(tmp_path: Path):
    wearer = {"height_m": 1.7, "mass_kg": 70.0, "sex": "male"}
    paths = [ours(tmp_path / "a.mcap"), ours(tmp_path / "b.mcap", phase="identify", wearer=wearer)]
    empty, worn = read_motions(RIG, paths, {}, is_torque=False)
    assert empty.worn is None
    assert not worn.motions
    assert worn.worn is not None
    assert worn.worn.wearer == wearer
    assert worn.worn.seconds == pytest.approx(worn.worn_s, abs=0.01)
    np.testing.assert_allclose(worn.worn.current, CURRENT)


def test_a_recording_of_another_machine_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match=r"has the joints a, b, c, d; recupera_like has shoulder_flexion"):
        read(ours(tmp_path / "a.mcap", ("a", "b", "c", "d")))


def test_a_recording_of_an_arm_in_the_machine_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match="has no tick of an empty machine: an arm is in it"):
        read(ours(tmp_path / "a.mcap", phase="identify"))


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(RecordingError, match=r"none.mcap does not exist"):
        read(tmp_path / "none.mcap")


@pytest.mark.parametrize(
    ("header", "row", "message"),
    [
        ("t,a,b", "0,1,2", "lacks q and current or tau: needed are"),
        ("t,q_shoulder_flexion", "0,x", "is no CSV with one line of names"),
    ],
)
def test_a_csv_with_other_columns_is_refused(tmp_path: Path, header: str, row: str, message: str):
    path = tmp_path / "a.csv"
    path.write_text(f"{header}\n{row}\n{row}\n")
    with pytest.raises(RecordingError, match=message):
        read(path)


def test_a_recording_that_is_too_slow_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match="ticks are 20 ms apart; at most 10 ms are allowed"):
        read(write_csv(tmp_path / "a.csv", rows=slice(None, None, 20)))


def test_a_ros_recording_is_read_by_the_names_of_the_joints(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/JointState", "jsonschema", b"{}")
        channel = writer.register_channel("/joint_states", "json", schema)
        for t, q, current in zip(T, Q, CURRENT, strict=True):
            stamp = {"sec": int(t), "nanosec": round(1e9 * (t - int(t)))}
            message = {
                "header": {"stamp": stamp},
                "name": RIG.joints[::-1],
                "position": q[::-1].tolist(),
                "velocity": [],
                "effort": (current * RIG.nominal_gain)[::-1].tolist(),
            }
            writer.add_message(channel, int(1e9 * t), json.dumps(message).encode(), int(1e9 * t))
        writer.finish()
    (motion,) = read(path)
    np.testing.assert_allclose(motion.current[5:-5], CURRENT[5:-5], atol=1e-3)
    assert np.isnan(motion.current_asked).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no row of numbers"),
        ("t,q_1\n", "no row of numbers"),
        ("t,q_1\n0,1,2\n", "2 names of columns, and 3 columns"),
        ("t,q_1,q_2,q_3,q_4\n0,1,2,3,4\n", "lacks current or tau: needed are"),
        ("q_1,q_2,q_3,q_4,i_1,i_2,i_3,i_4\n0,1,2,3,4,5,6,7\n", "lacks time: needed are"),
    ],
)
def test_a_csv_that_cannot_be_used_says_what_is_missing(tmp_path: Path, text: str, message: str):
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match=message):
        read(path)


def test_a_csv_in_degrees_is_refused_until_it_is_said(tmp_path: Path):
    path = write_csv(tmp_path / "a.csv")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[:, 1 : 1 + len(RIG.joints)] = np.rad2deg(table[:, 1 : 1 + len(RIG.joints)])
    np.savetxt(path, table, delimiter=",", header=path.read_text(encoding="utf-8").splitlines()[0], comments="")
    with pytest.raises(RecordingError, match="give --degrees"):
        read(path)
    (recording,) = read_motions(RIG, [path], {}, is_torque=True, is_degrees=True)
    np.testing.assert_allclose(recording.motions[0].q, Q, atol=1e-12)


@pytest.mark.parametrize("mass", [-1.0, 1500.0])
def test_a_weight_that_cannot_be_kilograms_is_refused(tmp_path: Path, mass: float):
    path = write_csv(tmp_path / "a.csv")
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([f"{head},weight_kg", *(f"{row},{mass}" for row in rows)]), encoding="utf-8")
    with pytest.raises(RecordingError, match="Give kilograms"):
        read(path)


def test_no_recording_is_refused():
    with pytest.raises(ConfigError, match="No recording is given"):
        read()


def test_a_recording_that_names_another_machine_with_the_same_joints_is_refused(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, RIG.joints, {"rig": "another"}):
        pass
    with pytest.raises(RecordingError, match="is a recording of 'another'"):
        read(path)

"""Forms of several programs that hold the same motion are read alike."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from tests.foreign_recordings import (
    by_weight,
    write_csv,
    write_lerobot,
    write_lerobot_csv,
    write_ros_bag,
    write_ros_mcap,
    write_states,
    write_wrenches,
)

from exograv.errors import ConfigError, RecordingError
from exograv.identification.machine_twin.drive_response import encoder_step
from exograv.identification.machine_twin.measured_motion import MeasuredMotion, has_motor_encoders
from exograv.model.description import load_rig
from exograv.procedures.machine_twin.fit_command import fit_and_write
from exograv.procedures.machine_twin.options import TwinFitOptions
from exograv.procedures.machine_twin.read_motions import read_motions
from exograv.procedures.machine_twin.recorded_columns import hung_row

RIG = load_rig("recupera_like")
TICKS, PERIOD_S = 5000, 0.001
STEP_RAD = 2.0 * np.pi / 2**17
MOUNT = RIG.calibration.mount

Writer = Callable[[Path, MeasuredMotion], Path]
WRITERS: dict[str, Writer] = {
    "dataset": lambda folder, one: write_lerobot(folder / "set", RIG, one),
    "parquet": lambda folder, one: next(write_lerobot(folder / "set", RIG, one).rglob("*.parquet")),
    "table": lambda folder, one: write_lerobot_csv(folder / "table.csv", one),
    "mcap": lambda folder, one: write_ros_mcap(folder / "ros.mcap", RIG, one),
    "bag": lambda folder, one: write_ros_bag(folder / "bag", RIG, one),
    "csv": lambda folder, one: write_csv(folder / "log.csv", RIG, [(3.0, one)], 1),
}
SILENT = ("mcap", "bag")
"""Sources that hold no commands."""


def moved(ticks: int = TICKS) -> MeasuredMotion:
    """Return a motion with 3 kg at the mount, as encoders and a twisting gear show it."""
    t = PERIOD_S * np.arange(ticks)
    q = STEP_RAD * np.round(np.sin(np.outer(t, [1.0, 0.7, 1.3, 0.9])) / STEP_RAD)
    current = 3.0 * np.cos(np.outer(t, [1.1, 0.8, 1.2, 0.6]))
    hung = np.tile(hung_row(RIG, MOUNT, 3.0), (ticks, 1))
    return MeasuredMotion("made", t, q, current, np.roll(current, -2, axis=0), hung, q_motor=q + 1e-3 * current)


def read(path: Path) -> MeasuredMotion:
    weights = {} if path.suffix == ".csv" and path.stem == "log" else {str(path): (MOUNT, 3.0)}
    (recording,) = read_motions(RIG, [path], weights, is_torque=False)
    (motion,) = recording.motions
    return motion


@pytest.mark.parametrize("source", WRITERS)
def test_every_source_gives_the_same_motion_with_its_weight(source: str, tmp_path: Path):
    made = moved()
    found = read(WRITERS[source](tmp_path, made))
    np.testing.assert_allclose(found.t - found.t[0], made.t, atol=1e-6)
    np.testing.assert_allclose(found.q, made.q, atol=2e-7)
    np.testing.assert_allclose(found.current, made.current, atol=1e-6)
    np.testing.assert_allclose(found.hung, made.hung)
    if source not in SILENT:
        np.testing.assert_allclose(found.current_asked, made.current_asked, atol=1e-6)


@pytest.mark.parametrize("source", WRITERS)
def test_a_source_has_only_what_it_holds(source: str, tmp_path: Path):
    found = read(WRITERS[source](tmp_path, moved()))
    assert np.isnan(found.current_asked).all() == (source in SILENT)
    assert has_motor_encoders([found]) == (source == "csv")
    assert not found.has_all_commands


@pytest.mark.parametrize("source", ["csv", "mcap"])
def test_a_force_sensor_is_read_with_its_frame(source: str, tmp_path: Path):
    made = moved()
    wrench = np.sin(np.outer(made.t, np.arange(1.0, 7.0)))
    (recording,) = read_motions(RIG, [WRITERS[source](tmp_path, replace(made, wrench=wrench))], {}, is_torque=False)
    (motion,) = recording.motions
    assert motion.wrench is not None
    np.testing.assert_allclose(motion.wrench, wrench, atol=1e-6)
    assert recording.force_frame == (MOUNT if source == "mcap" else None)


def test_a_recording_without_a_force_sensor_has_no_wrench(tmp_path: Path):
    assert [read(WRITERS[source](tmp_path, moved())).wrench for source in ("csv", "mcap")] == [None, None]


def test_a_frame_that_is_not_that_of_the_sensor_is_refused_before_the_fit(tmp_path: Path):
    with pytest.raises(ConfigError, match="'hand', which is no frame of"):
        fit_and_write(TwinFitOptions(RIG.name, (tmp_path / "none.csv",), force_frame="hand"), tmp_path)
    made = replace(moved(), wrench=np.zeros((TICKS, 6)))
    path = write_ros_mcap(tmp_path / "ros.mcap", RIG, made, "ft_sensor")
    with pytest.raises(ConfigError, match="at the frame 'ft_sensor', not at 'calibration_mount'"):
        fit_and_write(TwinFitOptions(RIG.name, (path,)), tmp_path)


def test_numbers_of_columns_do_not_stand_for_the_axes_of_a_force_sensor(tmp_path: Path):
    path = WRITERS["csv"](tmp_path, replace(moved(), wrench=np.ones((TICKS, 6))))
    text = path.read_text()
    for number, axis in enumerate("xyz", start=1):
        text = text.replace(f"force_{axis}", f"f{number}", 1).replace(f"moment_{axis}", f"m{number}", 1)
    path.write_text(text)
    assert read(path).wrench is None


def silenced(path: Path, keep: Callable[[float], bool], later_s: float = 0.0) -> Path:
    """Write the recording of a force sensor again, with the wrenches of some times only [s], stamped later."""
    made = moved()
    times = made.t[[keep(t) for t in made.t.tolist()]]
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        write_states(writer, RIG, made)
        write_wrenches(writer, times + later_s, np.ones((len(times), 6)), MOUNT)
        writer.finish()
    return path


def test_a_pause_of_the_force_sensor_is_no_motion_of_the_machine(tmp_path: Path):
    path = silenced(tmp_path / "ros.mcap", lambda t: not 2.2 < t < 2.5)
    (recording,) = read_motions(RIG, [path], {}, is_torque=False)
    begin, end = recording.motions
    assert begin.t[-1] == pytest.approx(2.2, abs=2e-3)
    assert end.t[0] == pytest.approx(2.5, abs=2e-3)


def test_a_force_sensor_with_another_clock_is_refused(tmp_path: Path):
    path = silenced(tmp_path / "ros.mcap", lambda _t: True, later_s=3600.0)
    with pytest.raises(RecordingError, match="Stamp both by the same clock"):
        read_motions(RIG, [path], {}, is_torque=False)


def test_moments_without_forces_are_refused(tmp_path: Path):
    path = WRITERS["csv"](tmp_path, replace(moved(), wrench=np.zeros((TICKS, 6))))
    path.write_text(path.read_text().replace("force_", "push_", 3))
    with pytest.raises(RecordingError, match="force_x, force_y and force_z"):
        read_motions(RIG, [path], {}, is_torque=False)


def test_stamps_of_32_bits_of_ten_minutes_keep_period_and_encoders(tmp_path: Path):
    found = read(write_lerobot(tmp_path / "set", RIG, moved(600_000)))
    assert found.period_s == pytest.approx(PERIOD_S, rel=1e-6)
    assert encoder_step(found.q[:, 0]) == pytest.approx(STEP_RAD, rel=1e-3)


def test_every_second_row_of_a_csv_keeps_the_weights_and_the_motors(tmp_path: Path):
    made = moved()
    path = write_csv(tmp_path / "log.csv", RIG, [(0.0, made), (3.0, made)], 2)
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[TICKS // 2 :, 0] += 10.0
    np.savetxt(path, table, delimiter=",", header=path.read_text().splitlines()[0], comments="")
    (recording,) = read_motions(RIG, [path], {}, is_torque=False)
    assert [one.period_s for one in recording.motions] == pytest.approx([2.0 * PERIOD_S] * 2)
    assert [float(row @ np.array(RIG.calibration.weights_kg)) for row, _ in by_weight(recording.motions)] == [0.0, 3.0]
    for one in recording.motions:
        assert one.q_motor is not None
        assert made.q_motor is not None
        np.testing.assert_allclose(one.q_motor, made.q_motor[::2], atol=1e-8)

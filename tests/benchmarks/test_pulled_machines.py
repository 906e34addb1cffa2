"""Pulls by hand on a hidden machine obey statics and the balance of power, and the force sensor has its errors."""

import csv
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exograv.recording import read_recording
from exograv.signals import Command
from hidden.draw import FORCE_NOISE, Hidden, draw
from hidden.engine import JOINTS, OMEGA, THETA, Engine, Q, V
from hidden.geometry import Geometry, read_geometry
from hidden.pulled import GainFit
from hidden.pulls import FORCE_N, ForceSensor, Operator
from hidden.rig import HiddenRig
from hidden.session import FORCE_COLUMNS, Session, write_table

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler: `engine.c` is compiled")

GAIN = np.array([6.75, 6.75, 4.5, 4.5])
MOUNT = "calibration_mount"
NOTHING = np.zeros(JOINTS)
FREE = dict.fromkeys(
    ("coulomb", "load_share", "ripple", "viscous", "eyring", "power", "bristle_damping", "gear_damping"), 0.0
) | {"stop_stiffness": 0.0, "stop_damping": 0.0, "gain_fall": 0.0, "law": 1.0, "bristle": 1e-9}
"""Values of a machine without friction."""
POSTURES = ([0.3, 0.5, -0.4, 1.0], [1.2, 0.2, 0.9, 0.4], [-0.5, 1.1, -1.2, 2.0])
GAIN_2000 = (7.2941684303273515, 7.101190802114116, 4.451847299291794, 4.514880231270553)
NOISE_2000 = (0.0171917454445992, 0.04444926643135453, 0.07419492145794811, 0.10830372812244676)
"""First and last drawn values of seed 2000, by the version before force sensors."""
WRENCH = np.array([12.0, -9.0, 15.0, 0.7, -0.4, 0.5])


@pytest.fixture
def geometry() -> Geometry:
    """Geometry with the axes of the mount turned in its link."""
    plain = read_geometry(Path(__file__).parents[2] / "robots" / "recupera_like" / "right.urdf")
    turned = Rotation.from_euler("xyz", [0.5, -0.8, 1.1]).as_matrix()
    return replace(plain, mount_axes={**plain.mount_axes, MOUNT: turned})


@pytest.fixture
def free(geometry: Geometry) -> Hidden:
    """Machine without friction."""
    hidden = draw(geometry, GAIN, 2003)
    changed = {name: np.full_like(hidden.values[name], value) for name, value in FREE.items()}
    return Hidden(hidden.seed, {**hidden.values, **changed}, hidden.sensing)


def jacobian(geometry: Geometry, q: np.ndarray) -> np.ndarray:
    """Velocity and angular velocity of the mount per joint velocity, in the mount's axes, by finite differences."""
    R, _ = geometry.pose(MOUNT, q)
    columns = []
    for step in 1e-5 * np.eye(JOINTS):
        (R_before, p_before), (R_after, p_after) = geometry.pose(MOUNT, q - step), geometry.pose(MOUNT, q + step)
        turn = Rotation.from_matrix(R_after @ R_before.T).as_rotvec()
        columns.append(np.concatenate([R.T @ (p_after - p_before), R.T @ turn]) / 2e-5)
    return np.array(columns).T


def in_link(geometry: Geometry, wrench: np.ndarray) -> np.ndarray:
    """Turn a force and a moment from the axes of the mount into those of its link."""
    return np.concatenate([geometry.mount_axes[MOUNT] @ each for each in wrench.reshape(2, 3)])


@pytest.mark.parametrize("posture", POSTURES)
def test_pull_shifts_the_torque_that_holds_the_machine_by_that_of_the_jacobian(
    posture: list[float], free: Hidden, geometry: Geometry
):
    q = np.array(posture)
    engine = Engine(free.values, q)
    _, weight = engine.links(q, NOTHING)
    shift = jacobian(geometry, q).T @ WRENCH
    assert np.abs(shift).min() > 0.05
    engine.grip(*geometry.mounts[MOUNT])

    def fastest(tau: np.ndarray, wrench: np.ndarray) -> float:
        """Largest speed within 0.1 s of motors that give `tau` [rad/s]."""
        engine.hold(q, tau)
        engine.wrench[:] = in_link(geometry, wrench)
        for _ in range(100):
            engine.advance(tau / free.values["gain"], NOTHING, np.inf)
        return float(np.abs(engine.x[V]).max())

    assert fastest(weight, np.zeros(6)) < 1e-6
    assert fastest(weight - shift, WRENCH) < 1e-6
    assert fastest(weight, WRENCH) > 0.1
    np.testing.assert_allclose(
        engine.pull_torque(*geometry.mounts[MOUNT], in_link(geometry, WRENCH), q), shift, atol=1e-8
    )


def test_energy_of_a_machine_without_friction_rises_by_the_work_of_the_pull(free: Hidden, geometry: Geometry):
    engine = Engine({**free.values, "gravity": np.zeros(3)}, np.array(POSTURES[0]))
    engine.grip(*geometry.mounts[MOUNT])
    engine.wrench[:] = in_link(geometry, WRENCH)

    def energy() -> float:
        q, v, theta, omega = (engine.x[part] for part in (Q, V, THETA, OMEGA))
        M, _ = engine.links(q, v)
        spring = free.values["stiffness"] * (theta - q) ** 2
        return 0.5 * float(v @ M @ v + omega @ (free.values["rotor"] * omega) + spring.sum())

    power, course = [0.0], [energy()]
    for _ in range(300):
        engine.advance(NOTHING, NOTHING, np.inf)
        power.append(float(WRENCH @ jacobian(geometry, engine.x[Q]) @ engine.x[V]))
        course.append(energy())
    work = 1e-3 * np.concatenate([[0.0], np.cumsum(0.5 * (np.array(power[1:]) + power[:-1]))])
    assert work[-1] > 3.0
    np.testing.assert_allclose(course, work, atol=5e-3)


def pulled_rig(hidden: Hidden, geometry: Geometry, seconds: float) -> tuple[ForceSensor, np.ndarray]:
    """Pull a machine without motor torque; return the sensor and the true wrenches in the mount's axes (tick, 6)."""
    rig = HiddenRig(geometry, hidden, np.array(POSTURES[0]))
    sensor, true = rig.mount_force_sensor(MOUNT), []
    rig.operator = Operator(np.random.default_rng(1), rig.t, seconds)
    for tick in range(round(seconds / rig.period_s)):
        rig.read()
        turned = rig.engine.wrench.reshape(2, 3) @ geometry.mount_axes[MOUNT]
        true.append(turned.ravel().copy())
        rig.write(Command(rig.t, tick, rig.t + 0.01, NOTHING, NOTHING))
    return sensor, np.array(true)


def test_force_sensor_has_scale_bias_and_noise_of_the_disclosed_machine(geometry: Geometry):
    hidden = draw(geometry, GAIN, 2004)
    sensor, true = pulled_rig(hidden, geometry, 8.0)
    measured, errors = np.array(list(sensor.samples.values())), hidden.force_sensing
    assert list(sensor.samples) == list(range(len(true)))
    assert np.linalg.norm(true[4000, :3]) > 10.0
    left = measured - errors.scale * true - errors.bias
    np.testing.assert_allclose(left.mean(axis=0), 0.0, atol=5.0 * FORCE_NOISE.max() / np.sqrt(len(true)))
    np.testing.assert_allclose(left.std(axis=0), FORCE_NOISE, rtol=0.05)


def test_scales_and_biases_of_force_sensors_have_their_stated_spread(geometry: Geometry):
    hidden = draw(geometry, GAIN, 2004)
    sensings = [replace(hidden, seed=seed).force_sensing for seed in range(2000, 2400)]
    assert np.std([one.scale for one in sensings]) == pytest.approx(0.0075, rel=0.15)
    np.testing.assert_allclose(np.std([one.bias for one in sensings], axis=0), FORCE_NOISE, rtol=0.2)


def test_operator_pulls_slowly_with_10_to_40_newtons_in_all_directions():
    seconds = 75.0
    t = np.arange(0.0, seconds, 0.04)
    forces = np.empty((0, 3))
    for seed in range(4):
        operator = Operator(np.random.default_rng(seed), 5.0, seconds)
        force = np.array([operator.wrench(5.0 + one, np.eye(3))[:3] for one in t])
        size = np.linalg.norm(force, axis=1)
        assert size[0] == 0.0
        assert size.max() <= FORCE_N[1] + 1e-9
        assert size[(t > 3.0) & (t < seconds - 3.0)].min() >= FORCE_N[0] - 1e-9
        spectrum = np.abs(np.fft.rfft(force, axis=0)) ** 2
        slow = np.fft.rfftfreq(len(t), 0.04) < 1.0
        assert spectrum[~slow].sum() < 0.02 * spectrum.sum()
        forces = np.concatenate([forces, force])
    assert forces.max(axis=0).min() > 20.0
    assert forces.min(axis=0).max() < -20.0


def test_direction_of_the_force_is_fixed_in_the_base_and_not_in_the_mount():
    operator, R = Operator(np.random.default_rng(1), 0.0, 20.0), Rotation.from_rotvec([0.4, 0.2, -0.9]).as_matrix()
    np.testing.assert_allclose(R @ operator.wrench(8.0, R)[:3], operator.wrench(8.0, np.eye(3))[:3], atol=1e-12)


def test_seeds_draw_the_machines_of_the_reported_results(geometry: Geometry):
    hidden = draw(geometry, GAIN, 2000)
    np.testing.assert_allclose(hidden.values["gain"], GAIN_2000, rtol=1e-12)
    np.testing.assert_allclose(hidden.sensing.current_noise, NOISE_2000, rtol=1e-12)


def test_gain_is_inside_its_interval_if_the_error_is_no_larger_than_half_of_it():
    found = GainFit("weight", ("a", "b"), np.array([0.01, -0.03]), np.array([0.0, 0.0]), np.array([0.02, 0.02]))
    assert list(found.rows()) == [
        "| weight | a | +1.00 | +0.00 | 2.00 | yes |",
        "| weight | b | -3.00 | +0.00 | 2.00 | no |",
    ]


@pytest.mark.long
def test_table_of_a_pulled_recording_has_one_measured_wrench_for_each_tick(geometry: Geometry, tmp_path: Path):
    session = Session(geometry, lambda gain: draw(geometry, gain, 2003))
    sensor = session.rig.mount_force_sensor(MOUNT)
    session.record(tmp_path / "plain.mcap", np.random.default_rng(0), held_out_s=4.0)
    write_table(tmp_path / "plain.mcap", sensor.samples)
    ticks = read_recording(tmp_path / "plain.mcap").ticks
    with (tmp_path / "plain.csv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header[-6:] == list(FORCE_COLUMNS)
    written = np.array([row[-6:] for row in rows], dtype=float)
    expected = [sensor.samples[number] for number in ticks["sequence"].tolist()]
    np.testing.assert_allclose(written, expected, rtol=1e-8)
    assert 0.9 < float((session.mean_gain["plain"] / session.hidden.values["gain"]).min()) <= 1.0

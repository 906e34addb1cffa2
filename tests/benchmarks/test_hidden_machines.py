"""The hidden machines obey mechanics: energy, a pendulum's period, and another engine's accelerations."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exograv.campaigns.faults.scenario import Scenario, ScenarioVerdict
from exograv.campaigns.faults.scenario_log import ScenarioLog
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, laboratory_at
from exograv.model.description import load_rig
from exograv.model.rig_settings import Excitation
from exograv.model.tree import inertial_parameters
from exograv.recording import read_recording
from exograv.rig import Rig, may_be_worn
from exograv.rig.twin import Disturbances
from exograv.safety.stops import StopReason
from exograv.signals import Command
from hidden.draw import Hidden, draw
from hidden.engine import JOINTS, OMEGA, THETA, Engine, Q, V
from hidden.further import Reached, further_table
from hidden.geometry import Geometry, read_geometry, with_links
from hidden.judge import held_out_errors, judge, judgement_text
from hidden.plain_fit import Motion, drive_fit, drive_response, link_columns
from hidden.reactions import row
from hidden.session import Session
from hidden.worn import HiddenLaboratory

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler: `engine.c` is compiled")

ROOT = Path(__file__).parents[2]
GAIN = np.array([6.75, 6.75, 4.5, 4.5])
FRICTION = ("coulomb", "load_share", "ripple", "viscous", "eyring", "power", "bristle_damping", "gear_damping")
STATES = (
    ([0.3, 0.5, -0.4, 1.0], [0.0, 0.0, 0.0, 0.0]),
    ([1.2, 0.2, 0.9, 0.4], [1.0, -0.7, 1.5, -2.0]),
    ([-0.5, 1.1, -1.2, 2.0], [-0.4, 1.3, 0.2, 0.9]),
)
NOTHING = np.zeros(JOINTS)

Machine = Callable[..., Hidden]


@pytest.fixture
def geometry() -> Geometry:
    return read_geometry(ROOT / "robots" / "recupera_like" / "right.urdf")


@pytest.fixture
def machine(geometry: Geometry) -> Machine:
    def make(seed: int = 1, **values: float) -> Hidden:
        hidden = draw(geometry, GAIN, seed)
        changed = {name: np.full_like(hidden.values[name], value) for name, value in values.items()}
        return Hidden(seed, {**hidden.values, **changed}, hidden.sensing)

    return make


def frictionless() -> dict[str, float]:
    return {**dict.fromkeys(FRICTION, 0.0), "stop_stiffness": 0.0, "stop_damping": 0.0}


def energy(engine: Engine, hidden: Hidden, geometry: Geometry) -> float:
    q, v, theta, omega = (engine.x[part] for part in (Q, V, THETA, OMEGA))
    M, _ = engine.links(q, v)
    kinetic = 0.5 * v @ M @ v + 0.5 * omega @ (hidden.values["rotor"] * omega)
    spring = 0.5 * float(np.sum(hidden.values["stiffness"] * (theta - q) ** 2))
    return float(kinetic) + spring + potential(q, hidden, geometry)


def potential(q: np.ndarray, hidden: Hidden, geometry: Geometry) -> float:
    """Energy in gravity, by transforms of SciPy."""
    R, p, total = np.eye(3), np.zeros(3), 0.0
    for joint, angle in enumerate(q):
        p = p + R @ geometry.origin[joint]
        R = R @ geometry.rotation[joint] @ Rotation.from_rotvec(angle * geometry.axis[joint]).as_matrix()
        total -= hidden.values["mass"][joint] * hidden.values["gravity"] @ (p + R @ hidden.values["com"][joint])
    return total


def in_mujoco(hidden: Hidden, geometry: Geometry) -> tuple[mujoco.MjModel, mujoco.MjData]:
    spec = mujoco.MjSpec()
    spec.option.gravity = hidden.values["gravity"]
    body = spec.worldbody
    for joint, name in enumerate(geometry.joints):
        body = body.add_body(name=name, pos=geometry.origin[joint])
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=geometry.axis[joint])
        body.explicitinertial = True
        body.mass, body.ipos = hidden.values["mass"][joint], hidden.values["com"][joint]
        inertia = hidden.values["inertia"][joint]
        body.fullinertia = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    model = spec.compile()
    return model, mujoco.MjData(model)


@pytest.mark.parametrize(("q", "v"), STATES)
def test_mass_matrix_and_bias_torque_are_those_of_mujoco(
    q: list[float], v: list[float], machine: Machine, geometry: Geometry
):
    hidden = machine()
    model, data = in_mujoco(hidden, geometry)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    M = np.empty((JOINTS, JOINTS))
    mujoco.mj_fullM(model, data, M)
    mine, bias = Engine(hidden.values, NOTHING).links(np.array(q), np.array(v))
    np.testing.assert_allclose(mine, M, atol=1e-10)
    np.testing.assert_allclose(bias, data.qfrc_bias, atol=1e-10)


def test_energy_stays_without_friction_and_motors(machine: Machine, geometry: Geometry):
    hidden = machine(**frictionless(), law=1.0, bristle=1e-9)
    engine = Engine(hidden.values, np.array([0.9, 0.4, -0.5, 1.2]))
    before = energy(engine, hidden, geometry)
    moved = 0.0
    for _ in range(2000):
        engine.advance(NOTHING, NOTHING, np.inf)
        moved = max(moved, float(np.abs(engine.x[V]).max()))
    assert moved > 0.5
    assert energy(engine, hidden, geometry) == pytest.approx(before, abs=2e-3)


def test_friction_only_takes_energy(machine: Machine, geometry: Geometry):
    for law in (0.0, 1.0):
        hidden = machine(law=law, stop_stiffness=0.0)
        engine = Engine(hidden.values, np.array([1.3, 0.6, -0.5, 1.2]))
        course = [energy(engine, hidden, geometry)]
        for _ in range(1500):
            engine.advance(NOTHING, NOTHING, np.inf)
            course.append(energy(engine, hidden, geometry))
        assert course[-1] < course[0] - 0.5
        assert np.diff(course).max() < 1e-3  # what the bristles give back


def test_elbow_swings_with_the_period_of_a_pendulum(machine: Machine):
    # Heavy rotors hold the shoulder in place; the elbow hangs free far from its stops.
    free = machine(**frictionless(), law=1.0, bristle=1e-9, stiffness=4e4)
    values = {**free.values, "gravity": np.array([0.0, 0.0, -9.81]), "rotor": np.array([1e9, 1e9, 1e9, 0.1])}
    engine = Engine(values, NOTHING)
    mass, com, inertia = (values[name][3] for name in ("mass", "com", "inertia"))
    angle = np.arctan2(com[0], -com[2])  # of the centre from the vertical, about the axis -y
    rest = -angle if values["axis"][3, 1] < 0.0 else angle
    M, bias = engine.links(np.array([0.0, 0.0, 0.0, -rest]), NOTHING)
    length = float(np.hypot(com[0], com[2]))
    assert M[3, 3] == pytest.approx(mass * length**2 + inertia[1, 1])
    for start in (rest, -rest):
        if abs(engine.links(np.array([0.0, 0.0, 0.0, start]), NOTHING)[1][3]) < 1e-9:
            rest = start
    engine.x[Q][3] = engine.x[THETA][3] = rest + 0.02
    crossed, before = [], 0.02
    for tick in range(4000):
        engine.advance(NOTHING, NOTHING, np.inf)
        now = float(engine.x[Q][3]) - rest
        if before > 0.0 >= now:
            crossed.append(1e-3 * (tick + before / (before - now)))
        before = now
    period = 2.0 * np.pi * np.sqrt((M[3, 3] + 0.1) / (mass * 9.81 * length))
    assert np.diff(crossed).mean() == pytest.approx(period, rel=2e-4)
    assert bias.shape == (JOINTS,)


def test_command_acts_after_the_delay_and_ends_with_its_expiry(machine: Machine):
    slow = machine(current_rad_s=300.0, current_ratio=0.0)
    for delay in (0.25e-3, 1.4e-3, 2.75e-3):
        engine = Engine({**slow.values, "command_delay": np.array(delay), "sensor_delay": np.array(0.0)}, NOTHING)
        charge = 0.0  # of a lag of first order: that of its input
        for _ in range(200):
            engine.advance(np.ones(JOINTS), NOTHING, 0.012)
            charge += 1e-3 * float(engine.sense()[2, 0])
        assert charge == pytest.approx(0.012 - delay, abs=7e-5)


def test_measurements_are_late_by_the_delay_of_the_sensors(machine: Machine):
    at = {delay: Engine({**machine().values, "sensor_delay": np.array(delay)}, NOTHING) for delay in (0.0, 0.8e-3)}
    courses = []
    for engine in at.values():
        course = []
        for _ in range(60):
            engine.advance(np.ones(JOINTS), NOTHING, np.inf)
            course.append(engine.sense()[2, 0])
        courses.append(np.array(course))
    now, late = courses
    ticks = np.arange(60.0)
    np.testing.assert_allclose(late[10:], np.interp(ticks[10:] - 0.8, ticks, now), atol=0.01)


def test_elbow_keeps_the_speed_at_which_friction_takes_the_torque(machine: Machine):
    for law in (0.0, 1.0):
        steady = machine(law=law, gravity=0.0, ripple=0.0, warm_fall=0.0, gain_fall=0.0, load_share=0.0)
        engine = Engine({**steady.values, "rotor": np.array([1e9, 1e9, 1e9, 0.1])}, NOTHING)
        current = np.array([0.0, 0.0, 0.0, engine.steady_friction(3, 0.5, 0.0, 0.0) / steady.values["gain"][3]])
        engine.x[V][3] = engine.x[OMEGA][3] = 0.5
        for _ in range(3000):
            engine.advance(current, NOTHING, np.inf)
        assert engine.x[OMEGA][3] == pytest.approx(0.5, rel=2e-3)


def test_links_differ_from_the_file_by_10_to_40_percent_and_are_bodies_that_can_exist(geometry: Geometry):
    for seed in range(20):
        values = draw(geometry, GAIN, seed).values
        apart = np.abs(values["mass"] / geometry.mass - 1.0)
        assert apart.min() >= 0.1
        assert apart.max() <= 0.4
        for inertia in values["inertia"]:
            moments = np.linalg.eigvalsh(inertia)
            assert 0.0 < moments[2] < moments[0] + moments[1]


def test_disclosed_machine_is_the_drawn_one(machine: Machine, tmp_path: Path):
    hidden = machine(5)
    hidden.disclose(tmp_path / "truth.json", {"a": GAIN})
    read = Hidden.disclosed(tmp_path / "truth.json")
    assert all(np.array_equal(read.values[name], value) for name, value in hidden.values.items())
    assert np.array_equal(read.sensing.current_noise, hidden.sensing.current_noise)


@pytest.fixture
def session(geometry: Geometry) -> Session:
    return Session(geometry, lambda gain: draw(geometry, gain, 3))


def test_hidden_machine_is_a_simulated_rig(session: Session):
    assert isinstance(session.rig, Rig)
    assert not may_be_worn(session.rig)
    assert session.rig.read() is session.rig.read()


def test_weight_on_a_mount_is_what_a_point_mass_adds_to_the_mass_matrix(session: Session, geometry: Geometry):
    q, v = np.array([0.4, 0.2, 0.3, 0.9]), np.array([0.5, -0.2, 0.1, 1.0])
    engine = session.rig.engine
    (M, bias), (link, place) = engine.links(q, v), geometry.mounts["calibration_mount"]
    session.rig.hang("calibration_mount", 3.0)
    loaded = [each.copy() for each in engine.links(q, v)]
    session.rig.hang("calibration_mount", 0.0)
    alone = Engine(session.hidden.values, NOTHING)
    for name, value in (("mass", np.eye(JOINTS)[link] * 3.0), ("inertia", np.zeros((JOINTS, 3, 3)))):
        alone.change(name, value)
    alone.change("com", np.tile(place, (JOINTS, 1)))
    for with_weight, without, weight in zip(loaded, (M, bias), alone.links(q, v), strict=True):
        np.testing.assert_allclose(with_weight - without, weight, atol=1e-9)
    np.testing.assert_allclose(engine.links(q, v)[0], M)


def true_fit(hidden: Hidden, folder: Path, friction: float = 1.0) -> Path:
    """File of a fit that knows the machine, with its friction times a factor."""
    engine = Engine(hidden.values, NOTHING)
    engine.change("ripple", NOTHING)
    speeds = np.concatenate([-np.linspace(0.005, 2.0, 400)[::-1], np.linspace(0.005, 2.0, 400)])
    table = [
        [friction * engine.steady_friction(joint, v, 0.0, 0.0) for joint in range(JOINTS)] for v in speeds.tolist()
    ]
    fit = {
        "friction": {"speed_rad_s": speeds.tolist(), "torque_Nm": table, "t_s": 0.0},
        "delay_ms": 1e3 * hidden.delay_s,
        "rotor_inertia_kgm2": (1.02 * hidden.values["rotor"]).tolist(),
        "axis_inertia_kgm2": (hidden.values["rotor"] + np.diag(engine.links(NOTHING, NOTHING)[0])).tolist(),
        "gain_Nm_per_A": hidden.values["gain"].tolist(),
    }
    path = folder / "fit.json"
    path.write_text(json.dumps(fit), encoding="utf-8")
    return path


@pytest.mark.long
def test_recording_is_read_and_a_fit_that_knows_the_machine_has_no_error(session: Session, tmp_path: Path):
    path = tmp_path / "short.mcap"
    session.record(path, np.random.default_rng(0), held_out_s=12.0)
    recording, notes = read_recording(path), json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    assert recording.remark is None
    assert set(recording.ticks["safe_state"].tolist()) == {0}
    assert [note["phase"] for note in notes["notes"]] == ["held_out", "held_out_fast", "home"]
    q = np.loadtxt(path.with_suffix(".csv"), delimiter=",", skiprows=1)[:, 1:5]
    np.testing.assert_allclose(q, recording.ticks["q_measured"], atol=1e-8)
    found = judge(session.hidden, true_fit(session.hidden, tmp_path), path)
    np.testing.assert_allclose(found.friction_error, 0.0, atol=1e-3)
    np.testing.assert_allclose(found.rotor_error, 0.02, atol=1e-12)
    np.testing.assert_allclose([*found.axis_error, *found.gain_error, found.delay_error_ms], 0.0, atol=1e-9)
    wrong = judge(session.hidden, true_fit(session.hidden, tmp_path, friction=1.1), path)
    np.testing.assert_allclose(wrong.friction_error, 0.1, atol=1e-3)
    assert "delay +0.000 ms" in judgement_text(found)


def test_noise_alone_is_a_held_out_error_of_one():
    noise = np.array([0.1, 0.2, 0.3, 0.4])
    residual = noise * np.random.default_rng(0).normal(size=(60_000, JOINTS))
    moves = np.tile(np.arange(60_000)[:, None] % 4000 < 3000, (1, JOINTS))
    whole, moving, low = held_out_errors(residual, noise, moves)
    np.testing.assert_allclose([whole, moving], 1.0, atol=0.02)
    np.testing.assert_allclose(low, 1.0, atol=0.1)
    whole, moving, _ = held_out_errors(residual + noise * ~moves, noise, moves)
    np.testing.assert_allclose(whole, np.sqrt(1.25), atol=0.02)
    np.testing.assert_allclose(moving, 1.0, atol=0.02)


def test_drive_fit_finds_dead_time_and_bandwidth():
    asked = np.repeat(np.random.default_rng(0).normal(size=400), 20)
    for delay, bandwidth in ((0.7e-3, 200.0), (2.4e-3, 350.0)):
        ticks = np.empty(len(asked), dtype=[("tau_commanded", float, JOINTS), ("tau_measured", float, JOINTS)])
        ticks["tau_commanded"] = asked[:, None]
        ticks["tau_measured"] = drive_response(asked, delay, bandwidth)[:, None]
        found = drive_fit(ticks)
        np.testing.assert_allclose(found[0], delay, atol=5e-6)
        np.testing.assert_allclose(found[1], bandwidth, rtol=5e-3)


def test_dead_time_of_the_plain_drive_is_that_of_the_engine(machine: Machine):
    values = machine(current_rad_s=300.0, current_ratio=0.0).values
    values = {**values, "command_delay": np.array(1.3e-3), "sensor_delay": np.array(0.6e-3), "period": np.array(1e-3)}
    asked = np.repeat(np.random.default_rng(0).normal(size=40), 10)
    engine, measured = Engine(values, NOTHING), []
    for current in asked:
        measured.append(engine.sense()[2, 0])  # before the command of this tick, as a rig is read
        engine.advance(np.full(JOINTS, current), NOTHING, np.inf)
    np.testing.assert_allclose(measured, drive_response(asked, 1.9e-3, 300.0), atol=0.02)


def test_columns_of_the_links_add_up_to_their_torque(machine: Machine, geometry: Geometry):
    hidden = machine(gravity=0.0)
    q, v, a = np.random.default_rng(0).normal(size=(3, 5, JOINTS))
    hidden = Hidden(1, {**hidden.values, "gravity": np.array([0.0, 0.0, -9.81])}, hidden.sensing)
    parameters = []
    for mass, com, inertia in zip(*(hidden.values[name] for name in ("mass", "com", "inertia")), strict=True):
        about_origin = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))
        parameters += [mass, *(mass * com), *np.diag(about_origin), *about_origin[[0, 0, 1], [1, 2, 2]]]
    columns = link_columns(geometry, Motion(np.zeros(5), q, v, a, a))
    torque = Engine(hidden.values, NOTHING).torques(q, v, a)
    np.testing.assert_allclose(columns @ np.array(parameters), torque, atol=1e-9)


WORN_DEG = (30.0, 20.0, 10.0, 70.0)
WORN_AGREE_RAD = 2e-3
"""Largest difference of the two engines after a push of 0.2 s that turns a joint by 0.3 rad: their steps differ."""


@pytest.fixture
def worn(machine: Machine, geometry: Geometry) -> tuple[VirtualLaboratory, HiddenLaboratory]:
    """Twin and hidden machine of the same links, rotors and gains, without friction, with the same wearer."""
    description = load_rig("recupera_like", "right")
    still = dict.fromkeys((*FRICTION, "gain_fall", "current_ratio", "command_delay", "sensor_delay"), 0.0)
    hidden = machine(5, **still | {"bristle": 1e-3, "gear_damping": 20.0, "current_rad_s": 2e3})
    drawn = laboratory_at(description, Disturbances.at_level(0).without("coulomb", "viscous"), 3, 3)
    own = HiddenLaboratory.of(drawn, hidden, geometry, 0.0)
    bandwidth = hidden.values["current_rad_s"] / (2.0 * np.pi)
    twin = replace(own.machine, drives=replace(own.machine.drives, bandwidth=bandwidth))
    return replace(drawn, machine=twin), own


def test_worn_hidden_machine_moves_as_the_twin_of_the_same_values(worn: tuple[VirtualLaboratory, HiddenLaboratory]):
    twins = [laboratory.twin(1, 0.0, np.deg2rad(WORN_DEG)) for laboratory in worn]
    own, hidden = twins
    gain, held = own.truth.machine.drives.gain, own.truth.tau_motor
    start = own.truth.q.copy()
    for tick in range(400):
        tau = held + (np.array([4.0, 2.0, -2.0, 3.0]) if 100 <= tick < 300 else 0.0)
        for twin in twins:
            twin.write(Command(twin.t, tick, twin.t + 0.01, tau, tau / gain))
        if tick == 99:
            np.testing.assert_allclose(hidden.truth.q, start, atol=1e-4)
    assert np.abs(own.truth.q - start).max() > 0.2
    np.testing.assert_allclose(hidden.truth.q, own.truth.q, atol=WORN_AGREE_RAD)
    np.testing.assert_allclose(hidden.truth.q_arm, own.truth.q_arm, atol=WORN_AGREE_RAD)


def test_links_in_the_urdf_are_those_that_were_written(geometry: Geometry, machine: Machine, tmp_path: Path):
    values = machine(4).values
    links = {
        name: inertial_parameters(float(values["mass"][k]), values["com"][k], values["inertia"][k])
        for k, name in enumerate(geometry.joints)
    }
    path = tmp_path / "right.urdf"
    urdf = ROOT / "robots" / "recupera_like" / "right.urdf"
    path.write_text(with_links(urdf.read_text(encoding="utf-8"), links), encoding="utf-8")
    written = read_geometry(path)
    for name in ("mass", "com", "inertia"):
        np.testing.assert_allclose(getattr(written, name), values[name], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(written.origin, geometry.origin)


def verdict(time_ms: float | None, hand_m_s: float) -> ScenarioVerdict:
    stopped = None if time_ms is None else 500 + round(time_ms)
    reason = None if time_ms is None else StopReason.TORQUE_WRONG
    log = ScenarioLog(ticks=1800, stopped_tick=stopped, reason=reason, extra_way_deg=2.0, flight_hand_m_s=hand_m_s)
    return ScenarioVerdict(Scenario(0, 1, ("F09",)), log, False, {"F09": time_ms}, (), 0.5, True)


def test_reactions_stand_beside_each_other():
    true, draw = [verdict(4.0, 0.2), verdict(8.0, 0.4)], [verdict(6.0, 0.3), verdict(None, 0.5)]
    assert row("F09", true, [draw]) == [
        "2/2", "1/2", "1/2", "6 (8)", "6 (6)", "2.0 (2.0)", "2.0 (2.0)", "0.30 (0.40)", "0.40 (0.50)",
    ]  # fmt: skip


def test_table_of_a_further_motion_has_the_median_ratios_of_each_parameter():
    rows = [
        Reached("elbow", "rotor", 0.01, 0.5, 0.6, (1.0, -0.5)),
        Reached("elbow", "coulomb", 0.1, 0.9, 0.8, None),
        Reached("shoulder", "rotor", 0.01, 0.7, 0.8, (1.0, -0.5)),
    ]
    assert "rotor: median ratio predicted 0.60, reached 0.70" in further_table(rows)


@pytest.mark.long
def test_motion_of_a_design_is_recorded_after_the_machine_has_run(session: Session, tmp_path: Path):
    path = tmp_path / "further.mcap"
    still = [[0.0] * JOINTS]
    motion = Excitation(period_s=2.0, centre_deg=[20.0, 15.0, 0.0, 60.0], sine_deg=[[5.0] * JOINTS], cosine_deg=still)
    session.record_motion(path, motion)
    ticks = read_recording(path).ticks
    assert ticks["t"][-1] > 2.0
    assert np.ptp(np.rad2deg(ticks["q_measured"]), axis=0).min() > 5.0

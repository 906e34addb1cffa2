"""The twin measures as a machine does, obeys as a machine does, and hides what a machine hides."""

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from exograv.errors import RigError
from exograv.rig import Rig
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.rig.twin.machine.machine import GRAVITY
from exograv.signals import Command, JointState

LEVELS = [Disturbances.at_level(level) for level in range(5)]
REST_TOLERANCE = 1e-3  # rad in a second: the shoulder's path gives by 0.01 mm in the twin and not at all in the statics
REPEATED = 1e-6  # rad: other processors round otherwise, and sticking joints make much of it
FRICTIONLESS = LEVELS[0].without("coulomb", "viscous", "passive_damping", "cuff_damping")


def run(twin: Twin, seconds: float, current: float | Callable[[JointState], np.ndarray] = 0.0) -> list[JointState]:
    """Step the twin under a constant current, or a current that is a function of the measurement."""
    states = []
    for _ in range(round(seconds / twin.period_s)):
        state = twin.read()
        states.append(state)
        i = current(state) if callable(current) else np.full(len(twin.joints), current)
        twin.write(Command(state.t, state.sequence, state.t + 0.01, np.full(len(i), np.nan), i))
    return states


def test_the_twin_is_a_rig(make_twin):
    assert isinstance(make_twin(LEVELS[2]), Rig)


@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("is_worn", [False, True])
def test_every_machine_survives_shaking_at_every_level(make_twin, level: int, is_worn: bool):
    generator = np.random.default_rng(level)
    twin = make_twin(LEVELS[level], seed=level, is_worn=is_worn)
    run(twin, 0.5, lambda state: generator.normal(0.0, 2.0, 4) - 2.0 * state.q)
    assert np.abs(twin.truth.v).max() < 30.0


def test_the_same_seed_gives_the_same_run_bit_for_bit(make_twin):
    first, second = (run(make_twin(LEVELS[3]), 0.3, 1.0) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.q, other.q)
        np.testing.assert_array_equal(one.current, other.current)


@pytest.mark.parametrize(("level", "flexion"), [(2, 0.004743936373423527), (4, 0.2971463171082292)])
def test_a_run_of_an_earlier_version_comes_out_the_same(rig, level: int, flexion: float):
    # Recorded before the twin had arms of seven freedoms and machines for both arms: the wearers of published figures
    # must not change. They had straight elbows.
    disturbances = LEVELS[level].without("carrying_angle", "elbow_axis")
    machine, wearer = draw_machine(rig, disturbances, 3), draw_wearer(disturbances, 3)
    twin = Twin(rig, machine, wearer, 5, start_posture=np.array([0.5, 0.2, -0.1, 1.0]))
    generator = np.random.default_rng(1)
    for tick in range(400):
        state = twin.read()
        current = generator.normal(0.0, 2.0, 4) - 2.0 * state.q
        if tick == 200:
            twin.hang("hand", 1.0)
            twin.tau_voluntary[:] = [0.1, 0.2, 0.3, 0.4]
        twin.write(Command(state.t, state.sequence, state.t + 0.01, np.zeros(4), current))
    assert twin.truth.q[0] == pytest.approx(flexion, abs=REPEATED)


def test_an_arm_that_is_pushed_past_the_machines_stop_stays_stable_at_the_pole_of_its_angles(rig):
    # Without the implicit damping near 90° of abduction, the first of these twins diverged.
    highest = []
    for seed in (0, 2):
        machine, wearer = draw_machine(rig, LEVELS[2], seed), draw_wearer(LEVELS[2], seed)
        twin = Twin(rig, machine, wearer, 5, start_posture=np.array([0.8, 0.7, 0.0, 0.8]))
        current = twin.read().current.copy()
        twin.tau_voluntary[1] = 30.0
        states = []
        for _ in range(500):
            state = twin.read()
            twin.write(Command(state.t, state.sequence, state.t + 0.01, np.zeros(4), current))
            states.append(twin.truth)
        highest.append(max(np.rad2deg(truth.q_arm[1]) for truth in states))
        assert max(np.abs(truth.v_arm).max() for truth in states) < 10.0
    assert min(highest) > 88.0  # the push does reach the pole's neighbourhood


def test_a_cuff_that_slides_moves_the_arm_in_it_and_slides_back(make_twin):
    still, slid, back = (make_twin(LEVELS[2]) for _ in range(3))
    slid.slide_cuff("forearm", 0.03)
    back.slide_cuff("forearm", 0.03)
    back.slide_cuff("forearm", 0.0)
    for twin in (still, slid, back):
        run(twin, 0.2)
    assert np.abs(slid.truth.q_arm - still.truth.q_arm).max() > 0.01
    np.testing.assert_array_equal(back.truth.q_arm, still.truth.q_arm)
    with pytest.raises(RigError, match="Cuffs: upper_arm, forearm"):
        still.slide_cuff("hand", 0.03)


def test_another_seed_gives_other_noise(rig):
    machine, wearer = draw_machine(rig, LEVELS[2], 0), draw_wearer(LEVELS[2], 0)
    first, second = (Twin(rig, machine, wearer, seed).read() for seed in (0, 1))
    assert (first.current != second.current).all()


def test_held_at_its_lock_torque_the_twin_stays_where_it_began(make_twin):
    twin = make_twin(FRICTIONLESS)
    before = twin.truth
    hold = before.tau_motor / before.machine.drives.gain
    run(twin, 1.0, lambda state: hold)
    np.testing.assert_allclose(twin.truth.q, before.q, atol=REST_TOLERANCE)
    np.testing.assert_allclose(twin.truth.q_arm, before.q_arm, atol=REST_TOLERANCE)


def energy(twin: Twin) -> float:
    """Energy of gravity, motion, cuffs and the shoulder's path [J], in NumPy on MuJoCo's positions."""
    scene, wearer = twin._scene, twin.truth.wearer
    assert wearer is not None
    model, data = scene.model, mujoco.MjData(scene.model)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data.qpos[:], data.qvel[:] = scene.data.qpos, scene.data.qvel
    mujoco.mj_forward(model, data)
    # At level 0 the shoulder's path is a point.
    total = float(data.energy.sum()) + 0.5e6 * float(data.qpos[scene.followers[0]]) ** 2
    for place in scene.cuffs:
        R_exo, R_arm = (data.xmat[body].reshape(3, 3) for body in (place.exo_body, place.arm_body))
        e_p = R_exo.T @ (data.xpos[place.arm_body] + R_arm @ place.p_arm - data.xpos[place.exo_body])
        S = R_exo.T @ R_arm @ place.R_arm
        e = np.array([*e_p, *(0.5 * np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]]))])
        total += 0.5 * float(e @ (wearer.cuffs.stiffness * e))
    return total


def test_unpowered_and_frictionless_the_twin_keeps_its_energy(make_twin):
    twin = make_twin(FRICTIONLESS, start_posture=np.array([0.8, 0.3, 0.2, 1.2]))
    run(twin, 0.02)
    energies = []
    for _ in range(19):  # 0.4 s; then the elbow meets its hard stop
        run(twin, 0.02)
        energies.append(energy(twin))
    assert np.ptp(energies) < 0.02  # J, of some 10 J that the fall turns into motion: the step's own error


def test_with_friction_and_dampers_the_twin_only_loses_energy(make_twin):
    twin = make_twin(LEVELS[0], start_posture=np.array([0.8, 0.3, 0.2, 1.2]))
    run(twin, 0.02)
    energies = [energy(twin)]
    for _ in range(25):
        run(twin, 0.02)
        energies.append(energy(twin))
    assert (np.diff(energies) < 1e-4).all()
    assert energies[-1] < energies[0] - 0.5


def test_an_expired_command_never_becomes_torque(make_twin):
    twin = make_twin(LEVELS[0], t0=5.0)
    for _ in range(3):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t - 1e-6, np.zeros(4), np.full(4, 3.0)))
    assert (twin.truth.tau_motor == 0.0).all()


def test_a_command_that_expires_on_its_way_never_becomes_torque(make_twin):
    late = LEVELS[0].with_row("delay", 4)  # 4 ms, half of them after the command
    for life, is_torque in ((0.001, False), (0.003, True)):
        twin = make_twin(late)
        for _ in range(8):
            state = twin.read()
            twin.write(Command(state.t, state.sequence, state.t + life, np.zeros(4), np.full(4, 3.0)))
        assert (twin.truth.tau_motor != 0.0).all() == is_torque


def falling_speed(make_twin, life_s: float, damping: np.ndarray | None, seconds: float = 0.3) -> float:
    """Speed of the shoulder after release with the arm stretched forward [rad/s].

    A command's life counts from the first tick.
    """
    twin = make_twin(LEVELS[1], start_posture=np.array([1.2, 0.2, 0.0, 0.4]))
    until, fastest = twin.t + life_s, 0.0
    while twin.t < seconds:
        twin.write(Command(twin.t, twin.read().sequence, until, np.zeros(4), np.zeros(4), damping))
        fastest = max(fastest, abs(twin.truth.v[0]))
    return fastest


def test_a_drive_brakes_with_the_damping_that_it_is_told(make_twin):
    none = falling_speed(make_twin, 1.0, None)
    braked = falling_speed(make_twin, 1.0, np.array([10.0, 10.0, 10.0, 4.0]))
    assert braked < 0.5 * none


def test_a_drive_that_hears_nothing_brakes_by_itself(make_twin):
    heard, unheard = falling_speed(make_twin, 1.0, None), falling_speed(make_twin, 0.005, None)
    assert unheard < 0.6 * heard


def test_a_drive_brakes_within_thirty_milliseconds_of_the_last_command_and_not_while_it_is_told(make_twin):
    twin = make_twin(LEVELS[2])
    run(twin, 0.1, 0.0)
    last = Command(twin.t, 0, twin.t + 0.005, np.zeros(4), np.zeros(4))
    assert not twin.drive_damping().any()
    silent_s = 0.0
    while not twin.drive_damping().all():
        twin.write(last)
        silent_s += twin.period_s
    assert 0.02 < silent_s - 0.001 <= 0.03
    run(twin, 0.02)
    assert not twin.drive_damping().any()


@pytest.mark.parametrize("factor", [-1.0, 2.0])
def test_a_motor_of_another_constant_gives_another_torque_at_once_and_its_current_does_not_say_so(make_twin, factor):
    twin, same = make_twin(LEVELS[2].without("current_noise")), np.ones(4)
    run(twin, 0.2, 1.0)
    tau, current = twin.truth.tau_motor, twin.read().current
    twin.turn_motor(2, factor)
    same[2] = factor
    np.testing.assert_array_equal(twin.truth.tau_motor, same * tau)
    after = run(twin, 0.05, lambda _: same)[1:]
    said = np.array([state.current for state in after]) / same
    np.testing.assert_allclose(said, np.tile(current, (len(said), 1)), rtol=0.01)


def test_the_motors_saturate(make_twin):
    twin = make_twin(LEVELS[0])
    run(twin, 0.005, 1e3)
    np.testing.assert_allclose(twin.truth.tau_motor, [60.0, 60.0, 30.0, 30.0])


def test_a_current_that_is_not_finite_is_refused(make_twin):
    twin = make_twin(LEVELS[2])
    with pytest.raises(RigError, match="elbow_flexion"):
        twin.write(Command(0.0, 0, 1.0, np.zeros(4), np.array([0.0, 0.0, 0.0, np.nan])))


def test_torque_per_current_is_the_machines_true_gain(make_twin):
    twin = make_twin(LEVELS[2].without("torque_bandwidth", "delay"))
    run(twin, 0.002, 0.5)
    np.testing.assert_allclose(twin.truth.tau_motor, 0.5 * twin.truth.machine.drives.gain)


def test_encoders_show_whole_steps_of_the_true_position_and_its_offset(make_twin):
    twin = make_twin(LEVELS[2].without("delay"))
    states = run(twin, 0.1, 1.0)
    sensors = twin.truth.machine.sensors
    step = 2.0 * np.pi / 2**17
    assert sensors.encoder_step == pytest.approx(np.full(4, step))
    counts = np.array([state.q for state in states]) / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    error = twin.read().q - twin.truth.q - sensors.encoder_offset
    assert np.abs(error).max() <= 0.5 * step * (1.0 + 1e-9)


def test_measured_currents_carry_the_noise_of_their_level(make_twin):
    twin = make_twin(LEVELS[2])
    drives = twin.truth.machine.drives
    hold = twin.truth.tau_motor / drives.gain
    currents = np.array([state.current for state in run(twin, 1.0, lambda state: hold)])
    np.testing.assert_allclose(np.std(currents * drives.gain, axis=0), 0.4, rtol=0.1)


def test_a_step_of_current_shows_after_the_whole_delay_and_not_before(make_twin):
    calm = LEVELS[0].with_row("delay", 3)  # 2.5 ms
    twin = make_twin(calm)
    hold = twin.truth.tau_motor / twin.truth.machine.drives.gain
    begin, states = 0.005, run(twin, 0.02, lambda state: hold + (state.t >= 0.005 - 1e-9))
    changed = [state.t for state in states if np.abs(state.current - hold).max() > 0.5]
    assert changed[0] == pytest.approx(begin + 0.003, abs=0.00051)  # the first whole millisecond after 2.5 ms


def test_asking_twice_in_one_period_gives_one_measurement(make_twin):
    twin = make_twin(LEVELS[3])
    assert twin.read() is twin.read()


def test_a_weight_at_the_mount_pulls_with_its_weight(make_twin, rig):
    twin = make_twin(LEVELS[0], is_worn=False, start_posture=np.deg2rad([0.0, 0.0, 0.0, 90.0]))
    before = twin._scene.data.qfrc_bias[3]
    twin.hang("calibration", 3.0)
    run(twin, 0.001)
    after = twin._scene.data.qfrc_bias[3]
    assert after - before == pytest.approx(3.0 * GRAVITY * 0.22, rel=1e-3)  # mount 0.22 m down the forearm


def test_weights_hang_only_where_something_holds_them(make_twin):
    with pytest.raises(RigError, match="Nothing can hang at 'hand'"):
        make_twin(LEVELS[0], is_worn=False).hang("hand", 1.0)
    with pytest.raises(RigError, match="-1"):
        make_twin(LEVELS[0]).hang("hand", -1.0)


def test_a_divergence_is_told_and_not_restarted(make_twin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log of its warnings where it runs
    twin = make_twin(LEVELS[0])
    twin._scene.data.qvel[0] = np.inf
    with pytest.raises(RigError, match="diverged"):
        run(twin, 0.002)


def held(twin: Twin, ticks: int) -> list[JointState]:
    """Run the twin with the current that carries it at the start."""
    drives = twin.truth.machine.drives
    current = twin.truth.tau_motor / drives.gain
    return run(twin, ticks * twin.period_s, lambda _state: current)


@pytest.mark.parametrize("level", range(5))
def test_time_that_passes_moves_nothing_and_no_drive_brakes(make_twin, level: int):
    twin = make_twin(LEVELS[level])
    before = held(twin, 50)[-1].t
    here, measured = twin.truth, twin.read()
    twin.pass_time(300.0)
    there = twin.truth
    assert twin.t == pytest.approx(before + 300.0 + twin.period_s)
    for name in ("q", "v", "q_arm", "v_arm", "tau_motor", "tau_muscle"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))
    np.testing.assert_array_equal(twin.read().q, measured.q)
    assert twin.read().t == twin.t
    held(twin, 1)
    assert not twin.drive_damping().any()


@pytest.mark.parametrize("level", [0, 2, 4])
def test_after_time_has_passed_the_twin_goes_on_as_if_none_had(make_twin, level: int):
    cold = LEVELS[level].without("warm_up")
    waits, goes_on = make_twin(cold), make_twin(cold)
    for twin in (waits, goes_on):
        held(twin, 50)
    waits.pass_time(1024.0)  # a power of two: the clock rounds nothing
    for late, soon in zip(held(waits, 50), held(goes_on, 50), strict=True):
        assert late.t == pytest.approx(soon.t + 1024.0)
        np.testing.assert_allclose(late.q, soon.q, atol=REPEATED)


def test_a_machine_warms_up_while_time_passes(make_twin):
    speeds = []
    for seconds in (0.0, 1800.0):
        twin = make_twin(LEVELS[4], is_worn=False)
        twin.pass_time(seconds)
        run(twin, 0.3)
        speeds.append(float(np.abs(twin.truth.v).max()))
    assert speeds[1] > speeds[0]


@pytest.mark.parametrize("seconds", [-1.0, np.nan, np.inf])
def test_no_time_passes_backwards_or_for_ever(make_twin, seconds: float):
    with pytest.raises(RigError, match="must be finite and not negative"):
        make_twin(LEVELS[0]).pass_time(seconds)

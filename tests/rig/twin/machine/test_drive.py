"""Drives stick, slip and lag as docs/explanation/disturbances.md says, and their friction only dissipates."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.rig.twin import Disturbances, Machine, draw_machine
from exograv.rig.twin.machine.drive import (
    BRISTLE_TRAVEL,
    DriveInput,
    FrictionState,
    drive_step,
    friction_step,
    sliding_friction,
)

DT = 0.0005
ELBOW = 3
INERTIA = 0.2  # kg·m², of a rotor and what it turns
LEVELS_AND_STEPS = [
    pytest.param(level, dt, marks=() if (level + 1) % 3 == k else pytest.mark.long)
    for k, dt in enumerate((0.00025, 0.0005, 0.001))
    for level in range(5)
]
"""Levels of disturbances and steps [s]: `make test` runs each level with one step, and each step with a level."""

CREEP_TOLERANCE = 1e-9  # rad in ten seconds: far below one step of any encoder here


def friction_function(machine: Machine, dt: float = DT) -> Callable[..., tuple[np.ndarray, ...]]:
    bristle, theta, omega, load = (ca.SX.sym(name) for name in ("bristle", "theta", "omega", "load"))
    results = friction_step(machine, ELBOW, bristle, FrictionState(theta, omega, load, ca.SX(0)), dt)
    return kernel.compile(ca.Function("friction", [bristle, theta, omega, load], list(results))).of


def sliding(machine: Machine, omega: float, load: float = 0.0, warmth: float = 0.0, theta: float = 0.0) -> float:
    now = FrictionState(*(ca.SX(x) for x in (theta, omega, load, warmth)))
    return float(ca.evalf(sliding_friction(machine, ELBOW, now)))


def push(machine: Machine, torque, seconds: float, dt: float = DT) -> np.ndarray:
    """Path of a free rotor under a torque [N·m] given against time [s]."""
    friction, theta, omega, bristle, way = friction_function(machine, dt), 0.0, 0.0, 0.0, []
    for k in range(round(seconds / dt)):
        rubbed, bristle = friction(bristle, theta, omega, 0.0)
        omega += dt / INERTIA * (torque(k * dt) - rubbed.item())
        theta += dt * omega
        way.append(theta)
    return np.array(way)


def plain(rig, level: int = 2) -> Machine:
    """Machine whose friction does not depend on position, load or direction."""
    calm = Disturbances.at_level(level).without("asymmetry", "friction_ripple", "load_friction")
    return draw_machine(rig, calm, 0)


def test_a_push_below_breakaway_bends_the_bristles_and_then_nothing_moves(rig):
    machine = plain(rig)
    way = push(machine, lambda t: 0.95 * machine.friction.coulomb[ELBOW], 12.0)
    assert 0.0 < way[-1] < 3.0 * BRISTLE_TRAVEL
    assert abs(way[-1] - way[len(way) // 6]) < CREEP_TOLERANCE


def test_a_trembling_push_below_the_elastic_share_does_not_creep(rig):
    machine = plain(rig)
    coulomb = machine.friction.coulomb[ELBOW]
    way = push(machine, lambda t: 0.3 * coulomb * min(t, 1.0) + 0.1 * coulomb * np.sin(40.0 * t), 10.0)
    period = round(2.0 * np.pi / 40.0 / DT)
    assert abs(way[-period:].mean() - way[-10 * period : -9 * period].mean()) < 2e-3 * BRISTLE_TRAVEL


def test_a_push_above_breakaway_moves_the_joint(rig):
    machine = plain(rig)
    breakaway = machine.friction.coulomb[ELBOW] * machine.friction.breakaway[ELBOW]
    assert push(machine, lambda t: 1.1 * breakaway, 1.0)[-1] > 0.1


def test_between_coulomb_and_breakaway_a_resting_joint_rests_and_a_moving_one_moves(rig):
    machine = plain(rig)
    coulomb = machine.friction.coulomb[ELBOW]
    between = 1.15 * coulomb
    assert push(machine, lambda t: between * min(t, 1.0), 3.0)[-1] < 3.0 * BRISTLE_TRAVEL
    assert push(machine, lambda t: 4.0 * coulomb if t < 0.2 else between, 3.0)[-1] > 0.2


@pytest.mark.parametrize(("level", "dt"), LEVELS_AND_STEPS)
def test_friction_never_feeds_energy_over_a_closed_way(rig, level: int, dt: float):
    for seed in range(2):
        friction = friction_function(draw_machine(rig, Disturbances.at_level(level), seed), dt)
        for amplitude, rate in ((1e-4, 30.0), (1e-3, 10.0), (0.3, 3.0)):
            times = np.arange(0.0, 4.0 * np.pi / rate, dt)
            bristle, work = 0.0, 0.0
            for k, t in enumerate(times):
                omega = amplitude * rate * np.cos(rate * t)
                rubbed, bristle = friction(bristle, amplitude * np.sin(rate * t), omega, 5.0)
                work += (k >= len(times) // 2) * rubbed.item() * omega * dt
            assert work > 0.0


@pytest.mark.parametrize(("level", "dt"), LEVELS_AND_STEPS)
def test_a_rubbing_rotor_never_has_more_energy_than_was_put_in(rig, level: int, dt: float):
    machine = draw_machine(rig, Disturbances.at_level(level), 0)
    friction, generator = friction_function(machine, dt), np.random.default_rng(0)
    theta = omega = bristle = put_in = 0.0
    for _ in range(round(0.5 / dt)):
        torque = 8.0 * generator.standard_normal()
        rubbed, bristle = friction(bristle, theta, omega, 0.0)
        before, omega = omega, omega + dt / INERTIA * (torque - rubbed.item())
        put_in += torque * dt * 0.5 * (before + omega)
        theta += dt * omega
        assert 0.5 * INERTIA * omega**2 <= max(put_in, 0.0) + 1e-12


def test_breakaway_is_the_stated_multiple_of_coulomb_friction(rig):
    machine = plain(rig)
    assert sliding(machine, 0.0) / sliding(machine, 100.0) == pytest.approx(1.3)


def test_asymmetry_load_and_warmth_change_friction_by_their_shares(rig):
    machine = plain(rig)
    friction, coulomb = machine.friction, machine.friction.coulomb[ELBOW]
    assert sliding(machine, 9.0, warmth=1.0) == pytest.approx(0.9 * coulomb)
    loaded = replace(machine, friction=replace(friction, load_share=np.full(4, 0.06)))
    assert sliding(loaded, 9.0, load=-20.0) == pytest.approx(coulomb + 0.06 * 20.0)
    lopsided = replace(machine, friction=replace(friction, asymmetry=np.full(4, 0.08)))
    assert sliding(lopsided, 9.0) == pytest.approx(1.08 * coulomb)
    assert sliding(lopsided, -9.0) == pytest.approx(0.92 * coulomb)


def test_ripple_repeats_with_every_turn_of_the_motor(rig):
    machine = draw_machine(rig, Disturbances.at_level(2).without("asymmetry"), 0)
    turn = 2.0 * np.pi / machine.drives.gear_ratio[ELBOW]
    over_a_turn = [sliding(machine, 9.0, theta=theta) for theta in np.linspace(0.3, 0.3 + turn, 41)]
    assert over_a_turn[0] == pytest.approx(over_a_turn[-1])
    assert np.ptp(over_a_turn) == pytest.approx(2 * 0.1, rel=0.02)


def drive_function(machine: Machine) -> ca.Function:
    state, asked, q, v = ca.SX.sym("state", 4), ca.SX.sym("asked"), ca.SX.sym("q"), ca.SX.sym("v")
    step = drive_step(machine, ELBOW, state, DriveInput(asked, q, v, ca.SX(0), ca.SX(0)), DT)
    return ca.Function("drive", [state, asked, q, v], [step.tau_joint, step.state_next])


def test_torque_follows_the_current_with_the_bandwidth_of_its_level(rig):
    drive = drive_function(draw_machine(rig, Disturbances.at_level(2), 0))
    state = np.zeros(4)
    for _ in range(round(1.0 / (2.0 * np.pi * 25.0) / DT)):
        _, state = drive(state, 10.0, 0.0, 0.0)
    assert float(state[3]) == pytest.approx(10.0 * (1.0 - np.exp(-1.0)), rel=0.03)


def test_friction_sits_on_the_motors_side_of_the_gear(rig):
    # A joint that is turned by less than the gear gives feels the gear's spring, not Coulomb friction.
    machine = draw_machine(rig, Disturbances.at_level(2), 0)
    drive = drive_function(machine)
    state, tau, small = np.zeros(4), 0.0, 2e-6
    for _ in range(2000):
        tau, state = drive(state, 0.0, small, 0.0)
    bristles = machine.friction.coulomb[ELBOW] / BRISTLE_TRAVEL
    gear = machine.drives.gear_stiffness[ELBOW]
    assert float(tau) == pytest.approx(-small * gear * bristles / (gear + bristles), rel=0.02)


def test_without_friction_lag_and_gear_the_joint_gets_what_is_asked(rig):
    drive = drive_function(draw_machine(rig, Disturbances.at_level(0).without("coulomb", "viscous"), 0))
    assert float(drive(np.zeros(4), 7.5, 0.3, 2.0)[0]) == 7.5

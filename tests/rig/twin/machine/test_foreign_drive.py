"""Drives of a foreign world follow their published laws, only take energy, and hide their gain from the sensors."""

import itertools
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from exograv.rig.twin import Disturbances, Examiner, Machine, Twin, draw_machine
from exograv.rig.twin.machine.drive import BRISTLE_TRAVEL, FrictionState, foreign_friction, sliding_friction
from exograv.rig.twin.machine.foreign_drive import (
    ARC_MINUTE,
    ELEMENTS,
    GAIN_BY_ANGLE,
    GAIN_BY_HEAT,
    LOAD_SPAN,
    TRAVELS,
    ForeignDrives,
    dahl,
    draw_foreign_drives,
    gear_hysteresis,
    heated,
    maxwell_slip,
)
from exograv.signals import Command

DT = 0.0005
ELBOW = 3
WORLD = Disturbances.at_level(2, "drives")
SEEDS = range(60)
COULOMB = 2.0

FORCES, FORCE, OMEGA, SLIDING = ca.SX.sym("f", ELEMENTS), ca.SX.sym("f1"), ca.SX.sym("omega"), ca.SX.sym("s")
GMS = maxwell_slip(FORCES, OMEGA, SLIDING, COULOMB, BRISTLE_TRAVEL, DT)
MAXWELL = ca.Function("maxwell", [FORCES, OMEGA, SLIDING], [GMS.tau, GMS.next])
DAHL_STIFFNESS = COULOMB / BRISTLE_TRAVEL
DAHL = ca.Function("dahl", [FORCE, OMEGA], [dahl(FORCE, OMEGA, ca.SX(COULOMB), DAHL_STIFFNESS, DT).next])


def drawn(machine: Machine) -> ForeignDrives:
    assert machine.foreign is not None
    return machine.foreign


def maxwell_path(path: np.ndarray, sliding: float = COULOMB) -> np.ndarray:
    """Friction torque along a path of positions, from a relaxed state."""
    forces, torques = np.zeros(ELEMENTS), []
    for step in np.diff(path):
        tau, forces = MAXWELL(forces, step / DT, sliding)
        torques.append(float(tau))
    return np.array(torques)


def test_maxwell_slip_sticks_as_springs_in_parallel_that_slide_one_after_the_other():
    fine = np.linspace(0.0, 1.1 * TRAVELS[-1] * BRISTLE_TRAVEL, 4001)
    torque = maxwell_path(fine)
    virgin = [np.minimum(fine[1:] / (TRAVELS[i] * BRISTLE_TRAVEL), 1.0) for i in range(ELEMENTS)]
    np.testing.assert_allclose(torque, COULOMB * np.mean(virgin, axis=0), atol=2e-3)
    assert torque[-1] == pytest.approx(COULOMB)


def test_maxwell_slip_remembers_the_reversal_of_an_inner_loop():
    # Return-point memory: after an inner loop the outer path goes on as if there had been none.
    top, inner = 2.0 * BRISTLE_TRAVEL, 1.2 * BRISTLE_TRAVEL
    up, down, again = np.linspace(0.0, top, 2001), np.linspace(top, inner, 1001), np.linspace(inner, top, 1001)
    torque = maxwell_path(np.concatenate([up, down[1:], again[1:]]))
    assert torque[-1] == pytest.approx(torque[len(up) - 2], abs=1e-6)
    assert torque[len(up) + len(down) - 3] < torque[-1] - 0.3 * COULOMB


def test_dahl_friction_approaches_its_level_exponentially_with_the_travel():
    force, speed = 0.0, 0.02
    for k in range(1, 61):
        force = float(DAHL(force, speed))
        assert force == pytest.approx(COULOMB * (1.0 - np.exp(-DAHL_STIFFNESS * k * speed * DT / COULOMB)))


def test_dahl_friction_does_not_depend_on_speed():
    slow = float(DAHL(0.5, 0.01))
    force = 0.5
    for _ in range(10):
        force = float(DAHL(force, 0.001))
    assert force == pytest.approx(slow)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5])
def test_foreign_friction_only_takes_energy_from_any_motion(rig, seed: int):
    machine = draw_machine(rig, WORLD, seed)
    forces, theta, omega, load = ca.SX.sym("f", ELEMENTS), ca.SX.sym("t"), ca.SX.sym("o"), ca.SX.sym("l")
    now = FrictionState(theta, omega, load, ca.SX(0.3))
    found = foreign_friction(machine, drawn(machine), ELBOW, forces, now, DT)
    step = ca.Function("friction", [forces, theta, omega, load], [found.tau, found.next])
    t = np.arange(0.0, 4.0, DT)
    generator = np.random.default_rng(seed)
    a, b, c = generator.uniform(0.2, 3.0, 3)
    path = 0.3 * np.sin(a * t) + 0.05 * np.sin(7.0 * b * t) + 1e-3 * np.sin(60.0 * c * t)
    state, work, least = np.zeros(ELEMENTS), 0.0, 0.0
    for before, after in itertools.pairwise(path):
        tau, state = step(state, before, (after - before) / DT, 5.0 * np.sin(before))
        work += float(tau) * (after - before)
        least = min(least, work)
    # Nothing is stored at the start, so that the friction can never have given more than it took.
    assert least >= 0.0
    assert work > 0.0


def test_steady_sliding_by_maxwell_slip_is_the_sliding_friction_of_the_speed(rig):
    machine = draw_machine(rig, WORLD, next(s for s in SEEDS if draw_foreign_drives(s, 4).is_maxwell))
    laws = replace(drawn(machine), ripple=np.zeros((4, 2)))
    for speed in (0.01, 0.05, 0.5, -0.5):
        now = FrictionState(ca.SX(0.2), ca.SX(speed), ca.SX(1.0), ca.SX(0.0))
        state = ca.SX.zeros(ELEMENTS)
        forces = ca.SX.sym("f", ELEMENTS)
        step = ca.Function(
            "friction", [forces], list(vars(foreign_friction(machine, laws, ELBOW, forces, now, DT)).values())
        )
        state, tau = np.zeros(ELEMENTS), np.zeros(1)
        for _ in range(2000):
            tau, state = step(state)
        steady = float(ca.evalf(sliding_friction(machine, ELBOW, now))) * np.sign(speed)
        assert float(tau) == pytest.approx(steady + machine.friction.viscous[ELBOW] * speed, rel=1e-6)


def test_the_map_of_wear_changes_the_level_of_dahl_friction_over_the_joint():
    for seed in SEEDS:
        laws = draw_foreign_drives(seed, 4)
        worn = [float(ca.evalf(laws.worn(ELBOW, ca.SX(angle)))) for angle in np.linspace(-np.pi, np.pi, 50)]
        assert 0.75 <= min(worn) < max(worn) <= 1.25
        assert np.ptp(worn) > 1e-3


def test_the_further_ripple_has_two_harmonics_and_no_more():
    laws = draw_foreign_drives(2, 4)
    angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    ripple = [float(ca.evalf(laws.further_ripple(ELBOW, ca.SX(a)))) for a in angle]
    size = np.abs(np.fft.rfft(ripple)) / 32.0
    assert set(np.flatnonzero(size > 1e-9)) == {2, 4}
    np.testing.assert_allclose(size[[2, 4]], laws.ripple[ELBOW])


def test_the_gain_changes_by_two_per_cent_over_the_angle():
    laws, angle = draw_foreign_drives(1, 4), np.linspace(-np.pi, np.pi, 721)
    gains = laws.gain_at(np.tile(angle[:, None], 4))
    np.testing.assert_allclose(gains.max(axis=0), 1.0 + GAIN_BY_ANGLE, atol=1e-5)
    np.testing.assert_allclose(gains.min(axis=0), 1.0 - GAIN_BY_ANGLE, atol=1e-5)
    assert float(ca.evalf(laws.gain(ELBOW, ca.SX(0.7), ca.SX(0.0)))) == pytest.approx(
        laws.gain_at(np.full(4, 0.7))[ELBOW]
    )


def test_ten_minutes_of_full_load_take_three_per_cent_of_the_gain():
    heat = ca.SX.sym("heat")
    step = ca.Function("heat", [heat], [heated(heat, ca.SX(10.0), 30.0, 1.0)])
    warm = 0.0
    for _ in range(round(LOAD_SPAN)):
        warm = float(step(warm))
    laws = draw_foreign_drives(0, 4)
    cold, hot = (float(ca.evalf(laws.gain(ELBOW, ca.SX(0.3), ca.SX(x)))) for x in (0.0, warm))
    assert hot / cold == pytest.approx(1.0 - GAIN_BY_HEAT)


def test_a_gear_winds_up_with_a_loop_of_the_drawn_width():
    stiffness, width = 1.5e4, 0.8 * ARC_MINUTE
    torque, rate = ca.SX.sym("torque"), ca.SX.sym("rate")
    step = ca.Function("gear", [torque, rate], [gear_hysteresis(torque, rate, stiffness, width, DT).next])
    turns, state, loop = 2e-3 * np.sin(np.linspace(0.0, 4.0 * np.pi, 8001)), 0.0, []
    for before, now in itertools.pairwise(turns):
        state = float(step(state, (now - before) / DT))
        loop.append(stiffness * now + state)
    second = slice(4000, 8000)
    wound, whole = turns[1:][second], np.array(loop[second])
    rising = np.gradient(wound) > 0.0
    # Wind-up at zero torque, on the way up and on the way down.
    zero = [
        np.interp(0.0, whole[way][order], wound[way][order])
        for way in (rising, ~rising)
        for order in [np.argsort(whole[way])]
    ]
    assert abs(zero[1] - zero[0]) == pytest.approx(width, rel=1e-3)


def test_both_laws_of_friction_are_drawn_and_the_hysteresis_fills_its_range():
    laws = [draw_foreign_drives(seed, 4) for seed in SEEDS]
    assert {one.is_maxwell for one in laws} == {True, False}
    widths = np.concatenate([one.hysteresis for one in laws]) / ARC_MINUTE
    assert 0.3 <= widths.min() < 0.32
    assert 0.98 < widths.max() <= 1.0


def test_the_sensors_do_not_see_the_gain(rig):
    quiet = WORLD.without("current_noise", "delay", "torque_bandwidth")
    machine = draw_machine(rig, quiet, 0)
    twin = Twin(rig, machine, None, 0)
    asked = np.array([0.5, -0.4, 0.3, 0.6])
    for _ in range(3):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t + 0.1, np.zeros(4), asked))
    np.testing.assert_allclose(twin.read().current, asked, rtol=1e-12)


def test_the_examiner_scores_the_torque_that_the_motors_deliver(rig):
    foreign, home = draw_machine(rig, WORLD, 0), replace(draw_machine(rig, WORLD, 0), foreign=None)
    postures = np.array([[0.3, 0.2, 0.1, 0.9]])
    one, other = (Examiner(rig, m, None, postures=postures).delivered(np.ones_like) for m in (foreign, home))
    np.testing.assert_allclose(one / other, drawn(foreign).gain_at(postures))


def test_the_laws_do_not_depend_on_the_level(rig):
    one, other = (drawn(draw_machine(rig, Disturbances.at_level(level, "drives"), 3)) for level in (0, 4))
    assert one.is_maxwell == other.is_maxwell
    np.testing.assert_array_equal(one.ripple, other.ripple)
    np.testing.assert_array_equal(one.hysteresis, other.hysteresis)

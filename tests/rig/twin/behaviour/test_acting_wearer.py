"""A wearer who acts gives anticipated torque and delayed reflexes, and never more than the arm's strength."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv import motion
from exograv.model.description import load_rig
from exograv.rig.twin import Disturbances, Examiner, Twin, draw_machine, draw_wearer
from exograv.rig.twin.behaviour.acting_wearer import ActingWearer, Nerves, usual_physiology
from exograv.rig.twin.behaviour.internal_model import in_gravity, out_of_the_machine
from exograv.signals import Command

DT = 1e-3
BODY = usual_physiology(4)
STILL = np.zeros(4)
POSTURE = np.deg2rad([30.0, 15.0, 10.0, 70.0])
LEVEL_0 = Disturbances.at_level(0)

SETTLED_Nm = 0.02
"""Residual torque after some seconds of holding [N·m]: the integral converges more slowly than a reflex."""


def holding(body=BODY) -> ActingWearer:
    """Wearer who wants to stay at `POSTURE`."""
    person = ActingWearer(body, DT)
    person.want(motion.hold(POSTURE, 0.01, DT), np.zeros((1, 4)), 0.0)
    return person


def act(twin: Twin, person: ActingWearer, seconds: float, current: np.ndarray) -> None:
    """Let the person act while the motors get a constant current [A]."""
    for _ in range(round(seconds / twin.period_s)):
        truth, state = twin.truth, twin.read()
        twin.tau_voluntary[:] = person.step(twin.t, truth.q_arm, truth.v_arm)
        twin.write(Command(state.t, state.sequence, state.t + 0.005, current, current))


def test_who_wants_nothing_gives_no_torque():
    assert not ActingWearer(BODY, DT).step(0.0, POSTURE, STILL).any()


@pytest.mark.parametrize("freedoms", [4, 5, 6, 7, 8, 10, 12, 14])
def test_each_freedom_of_one_arm_or_two_has_the_muscles_of_its_joint(freedoms: int):
    of_one = freedoms if freedoms <= 7 else freedoms // 2
    arm = usual_physiology(7).stiffness[:of_one].tolist()
    assert usual_physiology(freedoms).stiffness.tolist() == arm * (freedoms // of_one)


def test_where_the_arm_is_as_wanted_there_is_no_torque():
    person = holding()
    assert not np.array([person.step(k * DT, POSTURE, STILL) for k in range(200)]).any()


def test_a_reflex_comes_no_sooner_than_its_delay_and_no_later():
    with_reflex, without = holding(), holding(replace(BODY, nerves=Nerves(reflex_share=0.0)))
    away = POSTURE + 0.05
    pairs = [(with_reflex.step(k * DT, away, STILL), without.step(k * DT, away, STILL)) for k in range(100)]
    differs = [bool((one != other).any()) for one, other in pairs]
    assert np.argmax(differs) == round(BODY.nerves.delay / DT)


def test_tensed_muscles_are_stiffer_at_once():
    relaxed, tensed = holding(), holding()
    tensed.tension = np.full(4, 2.0)
    np.testing.assert_allclose(tensed.step(0.0, POSTURE + 0.05, STILL), 2.0 * relaxed.step(0.0, POSTURE + 0.05, STILL))


def test_anticipation_passes_the_muscles_with_their_lag():
    person = ActingWearer(BODY, DT)
    person.want(motion.hold(POSTURE, 0.01, DT), np.full((1, 4), 5.0), 0.0)
    torques = np.array([person.step(k * DT, POSTURE, STILL) for k in range(200)])
    reached = int(np.argmax(torques[:, 0] >= 5.0 * (1.0 - np.exp(-1.0)) - 1e-9))
    assert reached == pytest.approx(BODY.nerves.muscle_lag / DT, abs=1.0)


@settings(max_examples=30)
@given(
    error=st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4),
    v=st.lists(st.floats(-20.0, 20.0), min_size=4, max_size=4),
    anticipated=st.floats(-500.0, 500.0),
)
def test_nobody_is_stronger_than_strong(error: list[float], v: list[float], anticipated: float):
    person = ActingWearer(BODY, DT)
    person.want(motion.hold(POSTURE, 0.01, DT), np.full((1, 4), anticipated), 0.0)
    torques = np.array([person.step(k * DT, POSTURE + np.array(error), np.array(v)) for k in range(80)])
    assert (np.abs(torques) <= BODY.torque_max).all()


def test_without_weight_and_elasticity_it_costs_nothing_to_be_still():
    rig = load_rig("recupera_like")
    machine, wearer = draw_machine(rig, LEVEL_0, 1), draw_wearer(LEVEL_0, 1)
    twin = Twin(rig, in_gravity(machine, 0.0), out_of_the_machine(wearer), 1)
    person = ActingWearer(BODY, twin.period_s)
    person.want(motion.hold(twin.truth.q_arm, 0.01, DT), np.zeros((1, 4)), 0.0)
    act(twin, person, 0.5, np.zeros(4))
    np.testing.assert_allclose(twin.tau_voluntary, 0.0, atol=1e-9)


def test_holding_still_costs_just_what_the_locks_would_carry_for_the_arm():
    rig = load_rig("recupera_like")
    disturbances = LEVEL_0.without("coulomb", "viscous", "load_friction")
    machine, wearer = draw_machine(rig, disturbances, 1), draw_wearer(disturbances, 1)
    examiner, twin = Examiner(rig, machine, wearer), Twin(rig, machine, wearer, 1, start_posture=POSTURE)
    carried = examiner.lock_torque(POSTURE, arm=False)
    person = holding()
    act(twin, person, 5.0, carried / machine.drives.gain)
    held = twin.truth.q
    arm = examiner.lock_torque(held) - examiner.lock_torque(held, arm=False)
    missing = examiner.lock_torque(held, arm=False) - carried  # the current is constant while the posture settles
    np.testing.assert_allclose(twin.tau_voluntary, arm + missing, atol=SETTLED_Nm)


def test_both_sides_are_alike():
    torques = []
    for side in ("right", "left"):
        rig = load_rig("recupera_like", side)
        wearer = out_of_the_machine(draw_wearer(LEVEL_0, 1, side))
        twin = Twin(rig, draw_machine(rig, LEVEL_0, 1), wearer, 1)
        person = holding()
        act(twin, person, 1.0, np.zeros(4))
        torques.append(twin.tau_voluntary.copy())
    np.testing.assert_allclose(torques[0], torques[1], atol=1e-6)

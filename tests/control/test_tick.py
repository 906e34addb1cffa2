"""The tick removes the arm's weight and nothing else, according to the gravity level, with closed loops."""

from itertools import pairwise

import numpy as np
import pytest

from exograv.control.returned_friction import SHARE, TRAVEL
from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.signals import Reference

PARITY = 1e-9  # N·m: rounding, and postures closed to 1e-10 rad
Q = np.array([0.8, 0.3, -0.2, 1.3])
STILL = np.zeros(4)
DT = 1e-3
LAYOUT = parameters.ParameterLayout(segments=2, freedoms=4, arms=1, joints=4)
SETTLED_Nm = 1e-4  # one tick after the drive has ended; friction would be 1.5
SETTLING = 12  # ticks; the sag under the arm's weight settles by a factor of ten per tick
SAG_Nm = 0.1  # the arm sags by up to 2° more in its cuffs under 1.8 times its weight, which changes its lever arms
SLOPE_OF_CUFFS_Nm = 1e-8  # remaining gradient after predictor and one Newton step
SLOPE_OF_LOAD_Nm = 1e-8  # Newton's method with the load's stiffness keeps its accuracy from tick to tick


@pytest.fixture
def tick(assembly, machine) -> Tick:
    return Tick(assembly, machine)


def at_rest(tick: Tick, x: np.ndarray, mode: ControlMode, q: np.ndarray = Q, v: np.ndarray = STILL) -> np.ndarray:
    """Desired torque after the loops have closed."""
    tick.mode = mode
    tick.close(q, x)
    for _ in range(SETTLING):
        tick.step(q, v, Reference(q, STILL, STILL), x)
    return tick.tau_desired.copy()


def changed(x: np.ndarray, block: slice, value: float) -> np.ndarray:
    x = x.copy()
    x[block] = value
    return x


def test_level_one_leaves_the_arm_its_own_weight(tick, wearer):
    weightless, earth = (at_rest(tick, wearer, ControlMode(gravity_level=level)) for level in (0.0, 1.0))
    without_arm = at_rest(tick, changed(wearer, LAYOUT.phi, 0.0), ControlMode())
    # On Earth the motors carry the same as for an arm without mass: the machine and the strained cuffs.
    np.testing.assert_allclose(earth, without_arm, atol=PARITY)
    assert np.abs(weightless - earth).max() > 2.0


@pytest.mark.parametrize("level", [0.165, 0.378, 1.0, 1.8])
def test_torque_is_linear_in_the_gravity_level(tick, wearer, level: float):
    weightless, earth, felt = (at_rest(tick, wearer, ControlMode(gravity_level=g)) for g in (0.0, 1.0, level))
    np.testing.assert_allclose(felt, weightless + level * (earth - weightless), atol=SAG_Nm)


def test_the_strain_is_the_same_at_every_gravity_level(tick, wearer):
    massless, aligned = changed(wearer, LAYOUT.phi, 0.0), changed(wearer, LAYOUT.phi, 0.0)
    aligned[LAYOUT.fit] = 0.0
    modes = [ControlMode(gravity_level=level) for level in (0.0, 1.0, 1.8)]
    strains = [at_rest(tick, massless, mode) - at_rest(tick, aligned, mode) for mode in modes]
    assert np.abs(strains[0]).max() > 0.02
    for strain in strains[1:]:
        np.testing.assert_array_equal(strain, strains[0])


@pytest.mark.parametrize("block", [LAYOUT.stiffness, LAYOUT.spring_offset, LAYOUT.damping])
@pytest.mark.parametrize("level", [0.0, 1.0])
def test_the_elasticity_of_the_wearers_joints_is_never_compensated(tick, wearer, block: slice, level: float):
    v = np.array([0.5, -0.4, 0.3, 1.0])
    with_springs, without = (
        at_rest(tick, x, ControlMode(gravity_level=level), v=v) for x in (wearer, changed(wearer, block, 0.0))
    )
    np.testing.assert_array_equal(with_springs, without)


def test_no_inertia_is_compensated_while_floating(tick, wearer):
    light, heavy = (at_rest(tick, changed(wearer, LAYOUT.rotor, r), ControlMode()) for r in (0.0, 5.0))
    np.testing.assert_array_equal(light, heavy)
    tick.step(Q, STILL, Reference(Q + 0.3, STILL + 2.0, STILL + 9.0), wearer)
    np.testing.assert_allclose(tick.tau_desired, at_rest(tick, wearer, ControlMode()), atol=PARITY)


def test_without_a_known_arm_the_machine_alone_is_carried(tick, assembly, wearer):
    machine_alone = at_rest(tick, wearer, ControlMode(arm_share=0.0))
    massless = changed(changed(wearer, LAYOUT.phi, 0.0), LAYOUT.fit, 0.0)
    np.testing.assert_allclose(machine_alone, at_rest(tick, massless, ControlMode()), atol=PARITY)


def test_the_arms_share_enters_linearly(tick, wearer):
    none, half, all_of_it = (at_rest(tick, wearer, ControlMode(arm_share=share)) for share in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(half, 0.5 * (none + all_of_it), atol=SAG_Nm)


def moved(tick: Tick, x: np.ndarray, mode: ControlMode, ways: list[np.ndarray], v: np.ndarray = STILL) -> np.ndarray:
    """Desired torque after a sequence of small travels, minus that of a machine that was always at the last posture."""
    q = Q.copy()
    at_rest(tick, x, mode)
    for way in ways:
        q = q + way
        tick.step(q, v, Reference(q, STILL, STILL), x)
    returned = tick.tau_desired.copy()
    return returned - at_rest(tick, x, mode, q)


def test_floating_returns_friction_along_the_way_and_none_before_the_first(tick, wearer):
    assert np.abs(moved(tick, wearer, ControlMode(), [STILL] * SETTLING)).max() < PARITY
    forward, backward = (
        moved(tick, wearer, ControlMode(), [sign * np.full(4, TRAVEL / 2)] * SETTLING) for sign in (1.0, -1.0)
    )
    assert forward.min() > 0.6 * SHARE * 2.0
    assert backward.max() < -0.6 * SHARE * 2.0


def test_floating_never_returns_more_than_the_share_of_friction(tick, machine, wearer):
    ways, v = [np.full(4, TRAVEL)] * SETTLING, np.full(4, 0.5)
    returned = moved(tick, wearer, ControlMode(), ways, v)
    carried = at_rest(tick, wearer, ControlMode())
    friction = machine.friction
    assert (returned < SHARE * (friction.coulomb + friction.asymmetry + 0.06 * np.abs(carried) + 1.0 * v)).all()
    assert SHARE <= 0.8


def test_an_arm_that_is_let_go_after_a_drive_gets_no_friction_of_the_way_there(tick, wearer):
    tick.mode = ControlMode(drive=1.0)
    tick.close(Q, wearer)
    q = Q.copy()
    for _ in range(SETTLING):
        q = q + TRAVEL
        tick.step(q, STILL, Reference(q, STILL, STILL), wearer)
    tick.step(q, STILL, Reference(q, STILL, STILL), wearer)
    tick.mode = ControlMode()
    let_go = tick.step(q, STILL, Reference(q, STILL, STILL), wearer).copy()
    np.testing.assert_allclose(let_go, at_rest(tick, wearer, ControlMode(), q), atol=SETTLED_Nm)


def test_driving_adds_a_weak_pull_towards_the_reference(tick, assembly, wearer):
    tick.mode = ControlMode(drive=1.0)
    tick.close(Q, wearer)
    ahead, reference = Reference(Q + 0.01, STILL, STILL), Reference(Q, STILL, STILL)
    for _ in range(SETTLING):
        tick.step(Q, STILL, reference, wearer)
    pulled = tick.step(Q, STILL, ahead, wearer).copy()
    held = tick.step(Q, STILL, reference, wearer).copy()
    np.testing.assert_allclose(
        pulled - held, 0.01 * assembly.description.per_actuator("weak_kp_Nm_per_rad"), atol=PARITY
    )


def test_feed_forward_is_the_torque_that_identification_expects(tick, assembly, machine, wearer):
    v, a = np.array([0.7, -0.5, 0.9, 1.1]), np.array([-1.0, 2.0, 0.5, -2.0])
    tick.mode = ControlMode(drive=1.0)
    model = ArmModel(assembly, machine)
    tick.close(Q, wearer)
    for _ in range(SETTLING):
        tick.step(Q, v, Reference(Q, v, a), wearer)
        model.linearise(Sample(0.0, Q, v, a, STILL), wearer)
    expected, _ = model.linearise(Sample(0.0, Q, v, a, STILL), wearer)
    np.testing.assert_allclose(tick.tau_feedforward, expected, atol=PARITY)
    np.testing.assert_allclose(tick.tau_desired, tick.tau_feedforward, atol=PARITY)


@pytest.mark.parametrize(("arm", "slope_max"), [(0.0, SLOPE_OF_CUFFS_Nm), (1.0, SLOPE_OF_LOAD_Nm)])
def test_the_loops_stay_closed_at_three_radians_per_second(tick, assembly, wearer, arm: float, slope_max: float):
    lower, upper = assembly.description.workspace
    centre, reach = (lower + upper) / 2, (upper - lower) / 2
    t = np.arange(1500)[:, None] * DT
    path = centre + reach * np.sin(3.0 / reach * t + [0.0, 1.0, 2.0, 3.0])
    slopes, x = [], wearer.copy()
    x[LAYOUT.phi] *= arm
    for before, q in pairwise(path):
        tick.step(q, (q - before) / DT, Reference(q, STILL, STILL), x)
        slopes.append(tick.closure_slope)
    assert max(slopes[SETTLING:]) < slope_max


def test_a_jump_is_seen_in_the_slope_and_closing_from_cold_mends_it(tick, wearer):
    at_rest(tick, wearer, ControlMode())
    far = Q + 0.5
    tick.step(far, STILL, Reference(far, STILL, STILL), wearer)
    assert not tick.is_closed
    at_rest(tick, wearer, ControlMode(), q=far)
    assert tick.is_closed


@pytest.mark.parametrize("which", ["q", "v", "x"])
def test_a_broken_signal_reaches_the_guard_as_no_number(tick, wearer, which: str):
    at_rest(tick, wearer, ControlMode())
    q, v, x = Q.copy(), STILL.copy(), wearer.copy()
    {"q": q, "v": v, "x": x}[which][2] = np.nan
    assert np.isnan(tick.step(q, v, Reference(q, STILL, STILL), x)).any()
    assert which == "v" or not tick.is_closed or which == "x"


def test_the_same_state_gives_the_same_torque_to_the_last_bit(assembly, machine, wearer):
    one, other = (at_rest(Tick(assembly, machine), wearer, ControlMode()) for _ in range(2))
    np.testing.assert_array_equal(one, other)


def test_a_position_that_is_no_number_shows_in_the_slope(tick, wearer):
    at_rest(tick, wearer, ControlMode())
    assert tick.is_closed
    lost = Q.copy()
    lost[2] = np.nan
    tick.step(lost, STILL, Reference(lost, STILL, STILL), wearer)
    assert np.isnan(tick.closure_slope)
    assert not tick.is_closed


def test_another_tick_has_a_posture_and_a_mode_of_its_own(tick, wearer):
    expected = at_rest(tick, wearer, ControlMode())
    other = tick.again()
    at_rest(other, wearer, ControlMode(gravity_level=1.0), Q + 0.2)
    assert tick.mode.gravity_level == 0.0
    np.testing.assert_array_equal(tick.tau_desired, expected)
    tick.step(Q, STILL, Reference(Q, STILL, STILL), wearer)
    np.testing.assert_allclose(tick.tau_desired, expected, atol=PARITY)

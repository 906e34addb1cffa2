"""Muscles of the unseen world follow their published forms, store energy, and couple joints by their moment arms."""

import itertools

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.wearer.muscle_tissue import (
    BICEPS_ARM_CM,
    TOE,
    TRICEPS_ARM_CM,
    MomentArm,
    MuscleTissue,
    PassiveMuscle,
    both_muscled,
    draw_muscle_tissue,
)
from exograv.rig.twin.wearer.passive import passive_torque, relaxation

DT = 0.0005
FREEDOMS = ("flexion", "abduction", "rotation", "elbow")
SEEDS = range(40)
DIFFERENCE = 1e-6  # rad

# Round trip of a loop of some joules in steps of a milliradian, by the trapezoidal rule. Muscles that become slack on
# the way have kinks.


def unseen(level: int, seed: int):
    return draw_wearer(Disturbances.at_level(level, "unseen"), seed)


def tissue_of(level: int, seed: int) -> MuscleTissue:
    tissue = unseen(level, seed).passive.tissue
    assert isinstance(tissue, MuscleTissue)
    return tissue


def torque_of(tissue: MuscleTissue, stiffness: np.ndarray, angle: list[float]) -> np.ndarray:
    return np.asarray(ca.DM(ca.evalf(tissue.torque(stiffness, ca.SX(angle))))).ravel()


@pytest.mark.parametrize("reach", [-0.7, 0.0, 0.4, 1.4, 2.0])
def test_the_tension_is_exponential_to_the_toe_then_linear_and_zero_where_slack(reach: float):
    muscle = PassiveMuscle((MomentArm(0, (1.0,)),), steepness=1.7, taut=0.2, size=1.0)
    stretched = max(reach + 0.2, 0.0)
    wanted = np.exp(1.7 * min(stretched, TOE)) - 1.0
    wanted += 1.7 * np.exp(1.7 * TOE) * max(stretched - TOE, 0.0)
    assert float(ca.evalf(muscle.tension(ca.SX([reach])))) == pytest.approx(wanted)


@pytest.mark.parametrize("angle", [-1.2, 0.0, 0.9])
def test_the_moment_arm_is_the_slope_of_the_lengthening(angle: float):
    arm = MomentArm(0, (0.8, -0.3, 0.1, 0.05))
    lengths = [float(ca.evalf(arm.lengthening(ca.SX(angle + step)))) for step in (-DIFFERENCE, DIFFERENCE)]
    wanted = 0.8 - 0.3 * angle + 0.1 * angle**2 + 0.05 * angle**3
    assert float(ca.evalf(arm.arm(ca.SX(angle)))) == pytest.approx(wanted)
    assert (lengths[1] - lengths[0]) / (2.0 * DIFFERENCE) == pytest.approx(wanted, rel=1e-8)


def test_the_published_moment_arms_have_the_size_of_their_source_at_a_right_angle():
    # Ettema et al. (1998) and Pigeon et al. (1996): some 4 to 5 cm for the biceps, 2 cm for the triceps.
    biceps, triceps = (np.polynomial.polynomial.polyval(np.pi / 2.0, arm) for arm in (BICEPS_ARM_CM, TRICEPS_ARM_CM))
    assert biceps == pytest.approx(4.7, abs=0.1)
    assert triceps == pytest.approx(-1.9, abs=0.1)


def test_both_biarticular_muscles_have_their_published_moment_arms_at_the_elbow():
    wearer = unseen(2, 3)
    neutral, tissue = wearer.passive.neutral[3], tissue_of(2, 3)
    for muscle, published in zip(tissue.shared[:2], (BICEPS_ARM_CM, TRICEPS_ARM_CM), strict=True):
        elbow = muscle.arms[1]
        for angle in (-0.6, 0.0, 0.5):
            now, rest = (np.polynomial.polynomial.polyval(q, published) for q in (neutral + angle, neutral))
            ratio = float(ca.evalf(elbow.arm(ca.SX(angle)))) / elbow.coefficients[0]
            assert ratio == pytest.approx(now / rest)
    # Extension of the elbow lengthens the biceps, flexion the long head of the triceps.
    assert [np.sign(muscle.arms[1].coefficients[0]) for muscle in tissue.shared[:2]] == [-1.0, 1.0]


def test_each_pair_rests_at_the_neutral_angle_with_the_level_s_mean_stiffness():
    for seed in SEEDS:
        tissue = tissue_of(2, seed)
        for freedom, pair in enumerate(tissue.pairs):
            assert all(muscle.size > 0.0 for muscle in pair)
            alone = MuscleTissue((pair,), (), tissue.creep, tissue.courses, tissue.spectrum)
            at = [
                torque_of(alone, np.ones(4), [x if i == freedom else 0.0 for i in range(4)]) for x in (-1.0, 0.0, 1.0)
            ]
            below, rest, above = (one[freedom] for one in at)
            assert rest == pytest.approx(0.0, abs=1e-12)
            assert 0.5 * (above - below) == pytest.approx(1.0)
            assert below < 0.0 < above


@pytest.mark.long
def test_the_elbow_depends_on_flexion_by_up_to_half_of_its_stiffness():
    shares = []
    for seed in range(200):
        stiffness = draw_wearer(Disturbances.at_level(2), seed).passive.stiffness
        tissue = tissue_of(2, seed)
        for angle, muscle in ((-1.0, tissue.shared[0]), (1.0, tissue.shared[1])):
            tau = np.asarray(ca.DM(ca.evalf(muscle.torque(ca.SX([0.0, 0.0, 0.0, angle]))))).ravel()
            shares.append(abs(tau[3]) / stiffness[3])
    assert 0.0 <= min(shares) < 0.02
    assert 0.48 < max(shares) <= 0.5 + 1e-9


def test_the_coupling_depends_on_the_posture():
    def slope(tissue: MuscleTissue, elbow: float) -> float:
        """Torque of the elbow per angle of flexion [N·m/rad]."""
        both = [torque_of(tissue, np.ones(4), [x, 0.0, 0.0, elbow])[3] for x in (0.2, 0.3)]
        return (both[1] - both[0]) / 0.1

    ratios = [slope(tissue_of(2, seed), 0.6) / max(slope(tissue_of(2, seed), -0.6), 1e-3) for seed in range(20)]
    assert max(ratios) > 2.0


def test_the_stiffness_matrix_is_symmetric():
    q = ca.SX.sym("q", 4)
    for seed in range(8):
        tissue = tissue_of(3, seed)
        slope = ca.Function("slope", [q], [ca.jacobian(tissue.torque(np.full(4, 1.5), q), q)])
        matrix = np.asarray(slope([0.3, -0.2, 0.4, 0.5]))
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-12)


def test_damped_tissue_that_relaxes_only_takes_energy_from_a_cyclic_motion():
    wearer = unseen(3, 1)
    count = len(relaxation(wearer.passive))
    q, v, h = ca.SX.sym("q", 4), ca.SX.sym("v", 4), ca.SX.sym("h", 4, count)
    found = passive_torque(wearer.passive, q, v, h, DT)
    step = kernel.compile(ca.Function("step", [q, v, h], [found.tau, found.hysteresis_next])).of
    t = np.arange(0.0, 8.0, DT)
    path = wearer.passive.neutral + 0.5 * np.sin(np.pi * t)[:, None] * np.array([1.0, 0.5, -0.3, 0.8])
    state, work = np.tile(path[0][:, None], count), 0.0
    for before, now in itertools.pairwise(path):
        tau, state = step(0.5 * (now + before), (now - before) / DT, state)
        work += tau @ (now - before)
    assert work < 0.0  # four full cycles: the elastic energy is where it was


def test_the_rest_posture_creeps_by_its_angle_in_two_minutes():
    tissue = tissue_of(2, 4)
    assert np.all((np.abs(np.rad2deg(tissue.creep)) >= 5.0) & (np.abs(np.rad2deg(tissue.creep)) <= 15.0))
    for time, share in ((0.0, 0.0), (120.0, 1.0)):
        moved = np.asarray(ca.DM(ca.evalf(tissue.rest_moved(ca.SX(time))))).ravel()
        np.testing.assert_allclose(moved, share * tissue.creep, atol=1e-12)


def test_two_arms_are_not_coupled():
    one, other = (
        draw_muscle_tissue(seed, "wearer", FREEDOMS, np.ones(4), np.array([0.3, 0.5, 0.0, 1.9])) for seed in (1, 2)
    )
    first, second = [0.4, -0.3, 0.2, 0.5], [-0.2, 0.6, 0.1, -0.7]
    together = torque_of(both_muscled([one, other]), np.ones(8), first + second)
    np.testing.assert_allclose(together[:4], torque_of(one, np.ones(4), first))
    np.testing.assert_allclose(together[4:], torque_of(other, np.ones(4), second))


def test_the_laws_do_not_depend_on_the_level():
    one, other = (tissue_of(level, 6) for level in (1, 4))
    assert one.pairs == other.pairs
    assert one.courses == other.courses
    assert one.spectrum == other.spectrum
    assert [muscle.arms for muscle in one.shared] == [muscle.arms for muscle in other.shared]
    np.testing.assert_array_equal(one.creep, other.creep)

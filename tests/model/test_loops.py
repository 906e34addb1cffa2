"""Cuffs are strain-free where they were fastened, and the solver finds the posture that a followed arm reaches."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.dynamics.closure import closure, cuff_energy, newton_step
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.loops import (
    ELEVATION_ROUNDING,
    FIT,
    LoopSolver,
    arm_poses,
    arm_positions,
    cuff_residuals,
    elevation,
    shift_positions,
    shift_shape,
)
from exograv.model.rig_settings import ArmSide
from exograv.model.support import assemble

SAME_REST = 1e-7  # rad: a false minimum is 1.8 rad away
SAME_BATCH = 1e-6  # rad: both searches end where the energy no longer changes, which leaves 2e-7; Newton steps follow
PARITY = 1e-12
SLOPE_LEFT_Nm = 1e-5  # limit of the search, where the energy no longer changes; one Newton step of the tick removes it
POSTURES = 150
STAGES = 40  # steps of a followed path: 2° each at most


def random_fit(generator: np.random.Generator) -> np.ndarray:
    """Fit of a wearer up to 30 mm off, whose shoulder moves in any direction, with other cuffs and an oblique elbow."""
    return np.concatenate(
        [
            generator.uniform(-0.03, 0.03, 3),
            generator.uniform(0.0, 0.025, 1),
            generator.uniform(-0.01, 0.01, 1),
            generator.uniform(-0.3, 0.3, 2),
            generator.uniform(-0.2, 0.2, 2),
            generator.uniform(-0.012, 0.012, 2),
            generator.uniform(-0.006, 0.006, 12),
        ]
    )


@pytest.fixture(scope="module")
def follow(assembly) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Function that moves the arm from the donning posture to `y` by predictor and Newton steps."""
    cuffs = cuff_energy(assembly)
    y, z, fit = ca.SX.sym("y", 4), ca.SX.sym("z", 4), ca.SX.sym("fit", len(FIT))
    closed = closure(cuffs, y, newton_step(cuffs, y, z, fit), fit)
    step = kernel.compile(ca.Function("step", [y, z, fit], [closed.z, closed.G]))
    donning = assembly.description.donning_posture

    def followed(goal: np.ndarray, wearer: np.ndarray) -> np.ndarray:
        way = (goal - donning) / STAGES
        at = donning.copy()
        for k in range(STAGES):
            _, G = step.of(donning + k * way, at, wearer)
            at = at + G @ way
            for _ in range(2):
                at, _ = step.of(donning + (k + 1) * way, at, wearer)
        return at

    return followed


def test_a_search_from_the_machines_own_angles_finds_the_rest_that_a_followed_arm_reaches(assembly, follow):
    generator, solver = np.random.default_rng(0), LoopSolver(assembly)
    for _ in range(POSTURES):
        y, fit = generator.uniform(*assembly.description.workspace), random_fit(generator)
        z, slope = solver.solve(y, fit=fit)
        np.testing.assert_allclose(z, follow(y, fit), atol=SAME_REST)
        assert slope < SLOPE_LEFT_Nm


def test_a_search_from_anywhere_finds_that_rest_and_no_twisted_one(assembly, follow):
    generator, solver = np.random.default_rng(1), LoopSolver(assembly)
    for _ in range(POSTURES // 3):
        y, fit = generator.uniform(*assembly.description.workspace), random_fit(generator)
        z, _ = solver.solve(y, generator.uniform(-2.0, 2.0, 4), fit)
        np.testing.assert_allclose(z, follow(y, fit), atol=SAME_REST)


def test_an_aligned_arm_has_the_machines_angles(assembly):
    generator, solver = np.random.default_rng(2), LoopSolver(assembly)
    lower, upper = assembly.description.workspace
    for y in generator.uniform(lower, upper, (20, 4)):
        np.testing.assert_allclose(solver.solve(y, y + 0.1)[0], y, atol=SAME_REST)


def test_no_cuff_is_strained_where_it_was_fastened(assembly):
    y, fit = ca.SX.sym("y", 4), ca.SX.sym("fit", len(FIT))
    strain = ca.Function("strain", [y, fit], [cuff_residuals(assembly, y, y, fit)[0]])
    donning = assembly.description.donning_posture
    for seed in range(5):
        residual = strain(donning, random_fit(np.random.default_rng(seed)))
        np.testing.assert_allclose(np.array(residual), 0.0, atol=PARITY)


def test_a_cuff_that_has_slid_along_the_limb_is_strained_by_its_way_and_no_other_cuff_is(assembly):
    slid, donning = replace(assembly, slid_m=(0.0, 0.012)), assembly.description
    y, z = ca.SX(ca.DM(donning.donning_posture)), ca.SX(ca.DM(donning.arm_donning_posture))
    residuals, _ = cuff_residuals(slid, y, z, ca.SX.zeros(len(FIT)))
    np.testing.assert_allclose(numbers(residuals).ravel(), [*[0.0] * 6, 0.0, 0.0, -0.012, 0.0, 0.0, 0.0], atol=PARITY)


def numbers(expression: ca.SX) -> np.ndarray:
    return np.array(ca.evalf(expression)).ravel()


@pytest.mark.parametrize(
    ("flexion", "abduction", "expected"),
    [(90.0, 0.0, 90.0), (0.0, 60.0, 60.0), (45.0, 45.0, 60.0), (-50.0, 0.0, 50.0), (120.0, 0.0, 120.0)],
)
def test_elevation_is_the_angle_from_hanging(flexion: float, abduction: float, expected: float):
    z = ca.SX(np.deg2rad([flexion, abduction, 30.0, 60.0]))
    # Rounding increases the sine; this matters only near hanging.
    assert numbers(elevation(z))[0] == pytest.approx(np.deg2rad(expected), abs=ELEVATION_ROUNDING**2)


def test_a_hanging_arm_has_a_gradient_of_elevation():
    z = ca.SX.sym("z", 4)
    slope = ca.Function("slope", [z], [ca.gradient(elevation(z), z)])
    assert np.isfinite(np.array(slope([0.0, 0.0, 0.0, 0.0]))).all()


def test_shift_and_lengthening_follow_from_posture_and_fit(assembly):
    fit = np.zeros(len(FIT))
    fit[FIT.index("upper_arm_lengthening")] = 0.007
    x = numbers(arm_positions(assembly.arm, ca.SX([np.pi / 2, 0.0, 0.1, 0.2]), ca.SX(fit)))
    np.testing.assert_allclose(x, [0.0, 0.0, 0.0, np.pi / 2, 0.0, 0.1, 0.007, 0.2], atol=1e-12)


FORWARD = ca.SX([np.pi / 2, 0.0, 0.1, 0.2])
"""Arm that points forward; the shape of the shift is 90° there, up to the rounding near hanging."""


def shift_of_centre(side: ArmSide, **path: float) -> np.ndarray:
    """Displacement of a shoulder centre at `FORWARD` (3,), per radian of elevation [m/rad]."""
    worn = assemble(load_rig("recupera_like", side), Body(1.75, 75.0, "male"))
    fit = np.array([path.get(name.removeprefix("glenohumeral_"), 0.0) for name in FIT])
    body = worn.arm.limbs[0].shifts.stop - 1
    at, usual = (numbers(arm_poses(worn, FORWARD, ca.SX(ca.DM(one)))[body].p) for one in (fit, np.zeros(len(FIT))))
    return (at - usual) / float(numbers(shift_shape(FORWARD))[0])


@pytest.mark.parametrize(("side", "medial"), [("right", 1.0), ("left", -1.0)])
@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ({"slope": 0.02}, [0.0, 0.02 * np.sqrt(0.5), 0.02 * np.sqrt(0.5)]),
        ({"forward": 0.01}, [0.01, 0.0, 0.0]),
        ({"outward": 0.01}, [0.0, -0.01 * np.sqrt(0.5), 0.01 * np.sqrt(0.5)]),
        ({"slope": 0.02, "forward": -0.01, "outward": -0.02}, [-0.01, 0.04 * np.sqrt(0.5), 0.0]),
    ],
)
def test_the_shoulder_centre_moves_along_the_path_of_its_fit_and_mirrored_on_the_left(
    side: ArmSide, medial: float, path: dict[str, float], expected: list[float]
):
    np.testing.assert_allclose(shift_of_centre(side, **path), np.array([1.0, medial, 1.0]) * expected, atol=PARITY)


@pytest.mark.parametrize(
    ("flexion_deg", "abduction_deg", "shapes"),
    [
        (0.0, 0.0, {"bend": 0.0, "near_hanging": 1.0, "ahead": 0.0, "aside": 0.0}),
        (45.0, 0.0, {"bend": 1.0, "near_hanging": 0.0, "ahead": np.sqrt(0.5), "aside": 0.0}),
        (90.0, 0.0, {"bend": 0.0, "near_hanging": 0.0, "ahead": 1.0, "aside": 0.0}),
        (0.0, 45.0, {"bend": 1.0, "near_hanging": 0.0, "ahead": 0.0, "aside": np.sqrt(0.5)}),
        (0.0, -45.0, {"bend": 1.0, "near_hanging": 0.0, "ahead": 0.0, "aside": -np.sqrt(0.5)}),
        (-45.0, 0.0, {"bend": 1.0, "near_hanging": 0.0, "ahead": -np.sqrt(0.5), "aside": 0.0}),
    ],
)
@pytest.mark.parametrize("direction", ["up", "forward", "outward"])
def test_the_path_beside_the_usual_one_has_the_shape_of_its_entry(
    flexion_deg: float, abduction_deg: float, shapes: dict[str, float], direction: str
):
    z = ca.SX([np.deg2rad(flexion_deg), np.deg2rad(abduction_deg), 0.3, 0.2])
    for name, shape in shapes.items():
        fit = np.array([0.004 * (entry == f"glenohumeral_{name}_{direction}") for entry in FIT])
        moved = numbers(shift_positions(z, ca.SX(ca.DM(fit))))
        expected = 0.004 * shape * np.array([direction == one for one in ("up", "forward", "outward")])
        # The elevation is rounded near a hanging arm.
        np.testing.assert_allclose(moved, expected, atol=0.13 * 0.004)


def test_many_postures_in_one_batch_have_the_rests_of_single_searches(assembly):
    generator, solver = np.random.default_rng(3), LoopSolver(assembly)
    lower, upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    postures = generator.uniform(lower, upper, (POSTURES, len(lower)))
    for fit in (None, random_fit(generator)):
        found = solver.solve_many(postures, fit)
        alone = np.array([solver.solve(posture, fit=fit)[0] for posture in postures])
        np.testing.assert_allclose(found, alone, atol=SAME_BATCH)

"""Tissue of a foreign world follows its published laws, has the level's stiffness at 1 rad, and creates no energy."""

import itertools

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.options import WorldName
from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.wearer.passive import elastic_torque, passive_torque
from exograv.rig.twin.wearer.tissue import (
    CREEP_SPAN,
    CubicLaw,
    DeadZoneLaw,
    ElasticLaw,
    SinhLaw,
    Tissue,
    TwoSidedLaw,
    draw_tissue,
)

DT = 0.0005
ANGLE = ca.SX.sym("angle")
FREEDOMS = ("flexion", "abduction", "rotation", "elbow")
LAWS = [SinhLaw(1.4), TwoSidedLaw(0.6, 1.9), CubicLaw(), DeadZoneLaw(0.2)]
SEEDS = range(40)

# Round trip of a loop of some joules in steps of a milliradian, by the trapezoidal rule.
LOOP_TOLERANCE = 1e-5


def shape(law: ElasticLaw, angle: float) -> float:
    return float(ca.evalf(law.shape(ca.SX(angle))))


def stiffness_of(level: int) -> np.ndarray:
    return draw_wearer(Disturbances.at_level(level), 0).passive.stiffness


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_every_law_has_the_stiffness_of_the_level_at_one_radian_and_none_at_rest(law: ElasticLaw, side: float):
    assert shape(law, side) == pytest.approx(side)
    assert shape(law, 0.0) == 0.0


@pytest.mark.parametrize("angle", [-1.7, -0.4, 0.3, 1.2])
def test_the_laws_have_their_published_forms(angle: float):
    assert shape(SinhLaw(1.4), angle) == pytest.approx(np.sinh(1.4 * angle) / np.sinh(1.4))
    assert shape(CubicLaw(), angle) == pytest.approx(angle**3)
    beyond = np.sign(angle) * max(abs(angle) - 0.2, 0.0)
    assert shape(DeadZoneLaw(0.2), angle) == pytest.approx(beyond / 0.8)
    law = TwoSidedLaw(0.6, 1.9)
    a, c = np.log(law.sizes)
    offset = np.exp(c) - np.exp(a)
    assert shape(law, angle) == pytest.approx(np.exp(a + 0.6 * angle) - np.exp(c - 1.9 * angle) + offset)


@pytest.mark.parametrize("steepness", [(0.5, 2.0), (2.0, 0.5), (1.0, 1.0)])
def test_both_sides_of_the_double_exponential_pull_back(steepness: tuple[float, float]):
    assert min(TwoSidedLaw(*steepness).sizes) > 0.0


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_coupled_joints_have_no_direction_without_stiffness(level: int):
    for seed in SEEDS:
        stiffness = draw_wearer(Disturbances.at_level(level), seed).passive.stiffness
        tissue = draw_tissue(seed, "wearer", FREEDOMS, stiffness)
        np.testing.assert_array_equal(tissue.coupling, tissue.coupling.T)
        assert np.linalg.eigvalsh(np.diag(stiffness) + tissue.coupling)[0] > 0.0


def test_the_elbow_depends_on_flexion_by_up_to_half_of_its_stiffness():
    stiffness = stiffness_of(2)
    shares = [draw_tissue(seed, "wearer", FREEDOMS, stiffness).coupling[3, 0] / stiffness[3] for seed in range(300)]
    assert 0.0 <= min(shares) < 0.02
    assert 0.48 < max(shares) <= 0.5


@pytest.mark.parametrize("world", ["tissue", "unseen"])
def test_a_closed_path_through_the_tissue_gives_no_work(world: WorldName):
    for seed in range(8):
        wearer = draw_wearer(Disturbances.at_level(2, world), seed)
        q = ca.SX.sym("q", 4)
        tau = ca.Function("tau", [q], [elastic_torque(wearer.passive, q)])
        t = np.linspace(0.0, 2.0 * np.pi, 6001)
        turns = np.array([0.8 * np.cos(t), 0.7 * np.sin(t), 0.5 * np.sin(2.0 * t), np.cos(t)])
        path = wearer.passive.neutral[:, None] + turns
        torque = np.asarray(tau.map(len(t))(path))
        work = np.sum(0.5 * (torque[:, 1:] + torque[:, :-1]) * np.diff(path, axis=1))
        assert abs(work) < LOOP_TOLERANCE


def test_damped_tissue_with_hysteresis_only_takes_energy_from_a_cyclic_motion():
    wearer = draw_wearer(Disturbances.at_level(3, "tissue"), 1)
    q, v, h = (ca.SX.sym(name, 4) for name in ("q", "v", "h"))
    found = passive_torque(wearer.passive, q, v, h, DT)
    step = kernel.compile(ca.Function("step", [q, v, h], [found.tau, found.hysteresis_next])).of
    t = np.arange(0.0, 12.0, DT)
    path = wearer.passive.neutral + 0.5 * np.sin(np.pi * t)[:, None] * np.array([1.0, 0.5, -0.3, 0.8])
    state, work = path[0], 0.0
    for before, now in itertools.pairwise(path):
        tau, state = step(0.5 * (now + before), (now - before) / DT, state)
        work += tau @ (now - before)
    assert work < 0.0  # six full cycles: the elastic energy is where it was


def test_the_hysteresis_decays_with_the_time_of_the_wearer():
    wearer = draw_wearer(Disturbances.at_level(3, "tissue"), 2)
    tissue = wearer.passive.tissue
    assert isinstance(tissue, Tissue)
    q, v, h = (ca.SX.sym(name, 4) for name in ("q", "v", "h"))
    step = ca.Function("step", [q, v, h], [passive_torque(wearer.passive, q, v, h, DT).hysteresis_next])
    place, state = wearer.passive.neutral + 0.2, wearer.passive.neutral
    for _ in range(round(tissue.hysteresis_decay / DT)):
        state = np.asarray(step(place, np.zeros(4), state)).ravel()
    np.testing.assert_allclose((place - state) / 0.2, np.exp(-1.0), rtol=1e-3)  # the time is rounded to a step


def test_the_rest_posture_creeps_by_its_angle_in_two_minutes():
    tissue = draw_tissue(4, "wearer", FREEDOMS, stiffness_of(2))
    moved = ca.SX.sym("moved", 4)
    step = ca.Function("step", [moved], [tissue.crept(moved, 0.1)])
    state = np.zeros(4)
    for _ in range(round(CREEP_SPAN / 0.1)):
        state = np.asarray(step(state)).ravel()
    np.testing.assert_allclose(state, tissue.creep, rtol=1e-9)
    assert np.all((np.abs(np.rad2deg(tissue.creep)) >= 5.0) & (np.abs(np.rad2deg(tissue.creep)) <= 15.0))


def test_every_law_is_drawn():
    kinds = {type(law) for seed in SEEDS for law in draw_tissue(seed, "wearer", FREEDOMS, np.ones(4)).laws}
    assert kinds == {SinhLaw, TwoSidedLaw, CubicLaw, DeadZoneLaw}


def test_the_tissue_does_not_depend_on_the_level():
    one, other = (draw_wearer(Disturbances.at_level(level, "tissue"), 6).passive.tissue for level in (1, 4))
    assert isinstance(one, Tissue)
    assert isinstance(other, Tissue)
    assert one.laws == other.laws
    assert one.hysteresis_decay == other.hysteresis_decay
    np.testing.assert_array_equal(one.creep, other.creep)

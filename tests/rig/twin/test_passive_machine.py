"""A machine without motors falls under its own weight, has friction in its bearings, and never has a current."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.model.description import RigDescription, load_rig
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.signals import Command

RAISED = np.array([0.5, 0.1, 0.0, 0.4])
MILD = Disturbances.at_level(0)
FRICTIONLESS = MILD.without("coulomb", "viscous", "passive_damping", "cuff_damping")
SWING = 0.01  # of the period: 2 ms of some 1 s, and the amplitude's own share


@pytest.fixture(scope="module")
def motorless() -> RigDescription:
    return load_rig("recupera_like_passive")


@pytest.fixture(scope="module")
def make(motorless: RigDescription) -> Callable[..., Twin]:
    def make(disturbances: Disturbances, is_worn: bool = False, **options) -> Twin:
        wearer = draw_wearer(disturbances, 0) if is_worn else None
        return Twin(motorless, draw_machine(motorless, disturbances, 0), wearer, 0, **options)

    return make


def fall(twin: Twin, seconds: float, current: float = 0.0) -> np.ndarray:
    """True postures during a fall (tick, joint) [rad]."""
    way = []
    for _ in range(round(seconds / twin.period_s)):
        state = twin.read()
        assert (state.current == 0.0).all()
        twin.write(Command(state.t, state.sequence, state.t + 0.01, np.zeros(4), np.full(4, current)))
        way.append(twin.truth.q)
    return np.array(way)


@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("is_worn", [False, True])
def test_no_motor_means_no_current_and_no_torque_whatever_is_commanded(make, level: int, is_worn: bool):
    twin = make(Disturbances.at_level(level), is_worn, start_posture=RAISED)
    fall(twin, 0.1, current=5.0)
    assert (twin.truth.tau_motor == 0.0).all()
    assert np.abs(twin.truth.v).max() > 0.05


def test_let_go_it_falls_at_once(make):
    twin = make(MILD, start_posture=RAISED)
    way = fall(twin, 0.3)
    assert way[-1, 0] < RAISED[0] - 0.05
    assert way[-1, 3] < RAISED[3]


def test_without_friction_its_elbow_swings_as_long_as_a_pendulum_of_its_weight(make):
    # Weight and inertia by MuJoCo, the period by hand: T = 2π √(inertia / slope).
    twin = make(FRICTIONLESS, start_posture=np.array([0.0, 0.0, 0.0, 0.05]))
    scene = twin._scene
    model, elbow = scene.model, int(scene.exo[3])
    body = int(model.jnt_bodyid[elbow])
    model.dof_armature[scene.exo[:3]] = 1e6
    whole = model.body_subtreemass[body]
    com = scene.data.subtree_com[body] - scene.data.xanchor[elbow]
    slope = whole * np.linalg.norm(model.opt.gravity) * np.hypot(com[0], com[2])
    inertia = _about(model, scene.data, body, scene.data.xanchor[elbow])
    rest = float(np.arctan2(com[0], -com[2])) - 0.05  # angle of the centre while the elbow is at zero
    swing = fall(twin, 3.0)[:, 3] + rest
    crossings = np.flatnonzero((swing[1:] < 0.0) & (swing[:-1] >= 0.0)) * twin.period_s
    assert np.diff(crossings).mean() == pytest.approx(2.0 * np.pi * np.sqrt(inertia / slope), rel=SWING)


def _about(model, data, body: int, anchor: np.ndarray) -> float:
    """Inertia of a body and what hangs on it about y through `anchor` [kg·m²]."""
    total = 0.0
    for i in range(body, model.nbody):
        if i == body or model.body_parentid[i] == body:
            r = data.xipos[i] - anchor
            axes = data.ximat[i].reshape(3, 3)
            total += float((axes * model.body_inertia[i] @ axes.T)[1, 1] + model.body_mass[i] * (r[0] ** 2 + r[2] ** 2))
    return total


def test_with_friction_it_comes_to_rest(make):
    twin = make(Disturbances.at_level(2), start_posture=RAISED)
    ways = [fall(twin, 1.0) for _ in range(5)]
    travelled = [np.ptp(way, axis=0).max() for way in ways]
    assert travelled[-1] < 0.2 * max(travelled)


def test_it_rubs_far_less_than_a_drive(motorless):
    driven = load_rig("recupera_like")
    for level in range(5):
        disturbances = Disturbances.at_level(level)
        own, drives = (draw_machine(rig, disturbances, 1).friction for rig in (motorless, driven))
        assert (own.coulomb < 0.2 * drives.coulomb).all()
        assert (own.viscous < 0.2 * drives.viscous).all()
        assert (own.load_share == 0.0).all()
        assert (own.ripple == 0.0).all()

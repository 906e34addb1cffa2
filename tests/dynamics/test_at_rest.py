"""A machine without torque sinks until its weight gives no torque, or until it reaches its limits."""

import numpy as np
import pytest

from exograv.dynamics.at_rest import STEPS, _weight, carrying_torque, hanging_posture, weight_stiffness
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig, rig_names
from exograv.model.tree import Tree

MARGIN = np.deg2rad(4.0)
TORQUE_LEFT = 0.01  # N·m: a thousandth of the machine's weight
MACHINES = [name for name in rig_names() if not load_rig(name).motorless]


@pytest.fixture(params=MACHINES)
def tree(request: pytest.FixtureRequest) -> Tree:
    return read_exoskeleton(load_rig(request.param))


def test_away_from_its_limits_a_hanging_machine_carries_nothing(tree: Tree):
    q = hanging_posture(tree, MARGIN)
    tau = _weight(tree).of(q)[0]
    lower, upper = (np.array([getattr(joint, end) for joint in tree.joints]) for end in ("lower", "upper"))
    inside = (q > lower + MARGIN + 1e-9) & (q < upper - MARGIN - 1e-9)
    assert np.abs(tau[inside]).max(initial=0.0) < TORQUE_LEFT
    # At a limit the weight pulls towards it.
    assert (tau[~inside] * np.sign(q - 0.5 * (lower + upper))[~inside] <= TORQUE_LEFT).all()


def test_many_postures_at_once_have_the_torques_of_each_alone(tree: Tree):
    lower, upper = (np.array([getattr(joint, end) for joint in tree.joints]) for end in ("lower", "upper"))
    postures = np.array([[lower, 0.5 * (lower + upper)], [0.3 * lower, 0.6 * upper]])
    alone = [[carrying_torque(tree, q) for q in pair] for pair in postures]
    np.testing.assert_array_equal(carrying_torque(tree, postures), alone)


def test_it_hangs_stably(tree: Tree):
    q = hanging_posture(tree, MARGIN)
    assert np.diag(weight_stiffness(tree, q)).min() > -TORQUE_LEFT
    assert STEPS > 0

"""Known weights that the motors do not carry are refused before any motion, with the weight that they carry."""

import ast
import re
from dataclasses import replace

import numpy as np
import pytest

from exograv.dynamics.at_rest import carrying_torque
from exograv.errors import ConfigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.calibration.known_weights import (
    CARRIED_SHARE,
    carried_weight,
    refuse_heavy_weights,
    weights_not_carried,
)

RIG = load_rig("recupera_like")
TREE = read_exoskeleton(RIG)


def with_weights(description: RigDescription, weights_kg: list[float]) -> RigDescription:
    plan = description.calibration.model_copy(update={"weights_kg": weights_kg})
    return replace(description, settings=description.settings.model_copy(update={"calibration": plan}))


def with_torque(share: float) -> RigDescription:
    """Machine whose motors have this share of their torque."""
    weaker = [
        one.model_copy(update={"torque_max_Nm": share * (one.torque_max_Nm or 0.0)}) for one in RIG.settings.actuators
    ]
    return replace(RIG, settings=RIG.settings.model_copy(update={"actuators": weaker}))


@pytest.mark.parametrize("rig", ["recupera_like", "recupera_like_qdd", "nesm_like", "agree_like", "recupera_like_dual"])
def test_shipped_machines_carry_their_known_weights(rig: str):
    description = load_rig(rig)
    assert not weights_not_carried(description, read_exoskeleton(description))


def test_the_refusal_names_weights_that_the_machine_carries():
    with pytest.raises(ConfigError, match=r"motor of '\w+' \(\d+ N·m\) carries at most [\d.]+ kg") as refused:
        refuse_heavy_weights(with_weights(RIG, [1.5, 30.0]), TREE)
    advised = [ast.literal_eval(text) for text in re.findall(r"such as (\[.*?\])", str(refused.value))]
    refuse_heavy_weights(with_weights(RIG, min(advised, key=max)), TREE)


def test_the_heaviest_weight_leaves_the_stated_share_of_the_torque_and_no_more():
    sweep = RIG.calibration.sweeps[-1]
    carried = carried_weight(RIG, TREE, sweep)
    joint = RIG.joints.index(carried.joint)
    # A weight at the mount moves the elbow's torque beyond that of the links by at most the lever of the forearm.
    links = np.abs(carrying_torque(TREE, np.deg2rad(sweep.posture_deg))[joint])
    lever = (CARRIED_SHARE * carried.torque_max_Nm - links) / (9.81 * carried.kg)
    assert 0.1 < lever < 0.4


def test_motors_too_weak_for_the_links_are_told_so_and_no_weight_is_advised():
    weak = with_torque(0.02)
    told = weights_not_carried(weak, TREE)
    assert told
    assert all("stronger motor" in sentence and "such as" not in sentence for sentence in told)

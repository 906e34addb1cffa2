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
from exograv.procedures.bring_up.powered_steps import SPARE, bring_up_share
from exograv.procedures.calibration.known_weights import (
    CARRIED_SHARE,
    carried_weight,
    carrying_share,
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


def test_the_share_of_the_torque_at_rest_follows_from_links_weight_friction_and_motors():
    whole, half = carrying_share(RIG, TREE), carrying_share(with_torque(0.5), TREE)
    assert (half > 1.4 * whole).all()  # the usual friction of a weaker motor is lower
    heavier = carrying_share(with_weights(RIG, [3.0, 4.0]), TREE)
    assert (heavier >= whole).all()
    torque = max(np.abs(carrying_torque(TREE, np.deg2rad(one.posture_deg))).max() for one in RIG.calibration.sweeps)
    assert (whole * RIG.per_actuator("torque_max_Nm")).max() > torque
    # Half of the torque, which a bring-up may use, suffices for this machine.
    assert whole.max() < 0.5 / SPARE


def test_a_heavy_machine_may_use_more_than_half_of_its_torque_in_a_bring_up_and_a_light_one_may_not():
    for share, is_heavy in ((1.0, False), (0.5, True)):
        rig = with_torque(share)
        used = bring_up_share(rig, TREE)
        assert (used >= 0.5).all()
        assert (used <= 1.0).all()
        assert bool((used > 0.5).any()) == is_heavy
        assert (used >= np.minimum(carrying_share(rig, TREE), 1.0)).all()

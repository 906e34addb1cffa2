"""The same person is in every condition, and feels there the weight that its mechanism leaves."""

import pickle
from functools import cache

import numpy as np
import pytest

from exograv.campaigns.virtual_study.conditions import condition_of
from exograv.campaigns.virtual_study.session_setup import (
    SessionSetup,
    TrainingKnowledge,
    familiarisation_setup,
    flight_setup,
    free_setup,
    prepare_training,
    prepared_setup,
    scaled_friction,
    training_setup,
)
from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import NoTorque
from exograv.signals import Command, Reference

SEED, LEVEL = 1000, 1
OTHER_BASE_NM = 0.3  # The bases of two machines are tilted by up to 2° against each other.


def silent(_text: str, _share: float) -> None:
    """Ignore progress."""


@cache
def prepared(name: str, seed: int = SEED, level: int = LEVEL) -> TrainingKnowledge:
    """Prepare a training once for all tests."""
    return prepare_training(condition_of(name), seed, level, silent)


def stage_of(name: str, seed: int = SEED, level: int = LEVEL, day: int = 0) -> SessionSetup:
    return training_setup(prepared(name, seed, level), day)


def rested(stage: SessionSetup, seconds: float) -> np.ndarray:
    """Return the arm's freedoms after the person has been passive for this time [rad]."""
    twin, still = stage.twin, np.zeros(len(stage.twin.joints))
    for _ in range(round(seconds / twin.period_s)):
        state = twin.read()
        tau = stage.controller.step(state.q, still, Reference(state.q, still, still))
        twin.write(Command(state.t, state.sequence, state.t + 0.005, tau, stage.actuators.current(tau)))
    return twin.truth.q_arm


@pytest.mark.long
def test_every_stage_draws_the_same_person():
    level = 2
    stages = [
        stage_of("ideal", level=level), stage_of("ideal@quasi-direct+friction=2", level=level),
        stage_of("water", level=level), stage_of("parabolic", level=level),
        familiarisation_setup(SEED, level, 0), free_setup(SEED, level, 3, 0.0),
    ]  # fmt: skip
    first = stages[0].laboratory.wearer
    q = np.deg2rad([30.0, 10.0, 5.0, 60.0])
    for stage in stages[1:]:
        wearer = stage.laboratory.wearer
        assert wearer.body == first.body
        for bone, other in zip(wearer.arms[0].skeleton.bones, first.arms[0].skeleton.bones, strict=True):
            assert bone.mass == other.mass
            np.testing.assert_array_equal(bone.inertia, other.inertia)
        np.testing.assert_array_equal(wearer.passive.damping, first.passive.damping)
        own, usual = (one.own.torque(q, 0 * q, 0 * q) for one in (stage, stages[0]))
        assert np.abs(own - usual).max() < OTHER_BASE_NM


def test_days_differ_in_noise_alone_and_are_repeated_bit_for_bit():
    first, again, other = (rested(stage_of("ideal", day=day), 0.2) for day in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.0


def test_what_was_prepared_goes_to_another_process():
    sent = pickle.loads(pickle.dumps(prepared("ideal")))
    np.testing.assert_array_equal(rested(training_setup(sent, 1), 0.1), rested(stage_of("ideal", day=1), 0.1))


def test_weight_left_on_purpose_counts_as_left_over():
    left_over = {name: stage_of(name).left_over_Nm or 0.0 for name in ("ideal", "ideal+left=0.2", "ideal+left=1")}
    assert left_over["ideal"] == pytest.approx(0.0, abs=0.1)
    assert left_over["ideal+left=0.2"] == pytest.approx(0.2 * left_over["ideal+left=1"], rel=0.05)
    assert left_over["ideal+left=1"] > 3.0


def test_a_machine_that_carries_begins_at_the_weight_of_earth():
    controller = stage_of("ideal+left=0.2").controller
    assert isinstance(controller, ArmController)
    assert controller.mode.gravity_level == 1.0
    assert controller.mode.arm_share == pytest.approx(0.8)


def test_friction_is_the_machines_own_times_its_factor_and_the_wearer_stays():
    usual, rough, none = (stage_of(f"ideal{more}") for more in ("", "+friction=2", "+friction=0"))
    assert usual.friction_Nm is not None
    assert rough.friction_Nm == pytest.approx(2.0 * usual.friction_Nm)
    assert none.friction_Nm == 0.0
    friction, scaled = usual.laboratory.machine.friction, rough.laboratory.machine.friction
    for name in ("viscous", "load_share", "ripple"):
        np.testing.assert_allclose(getattr(scaled, name), 2.0 * getattr(friction, name))
    np.testing.assert_array_equal(scaled.breakaway, friction.breakaway)
    same = scaled_friction(usual.laboratory.machine, 1.0)
    np.testing.assert_array_equal(same.friction.coulomb, friction.coulomb)


def test_a_day_at_once_is_the_same_as_prepared_before():
    at_once = prepared_setup(condition_of("water"), SEED, LEVEL, 2, silent)
    np.testing.assert_array_equal(rested(at_once, 0.1), rested(stage_of("water", day=2), 0.1))


@pytest.mark.parametrize("name", ["water", "parabolic"])
def test_where_no_motor_acts_nothing_is_carried_or_left_over(name: str):
    stage = stage_of(name)
    assert isinstance(stage.controller, NoTorque)
    assert stage.left_over_Nm is None
    assert stage.worn_inertia.any() == (name == "parabolic")
    assert stage.exo == "passive"


def test_the_parabolic_training_is_a_flight():
    training, flight = rested(stage_of("parabolic"), 0.2), rested(flight_setup(SEED, LEVEL, 0), 0.2)
    np.testing.assert_array_equal(training, flight)


def test_an_arm_without_machine_begins_as_it_was_put_on_at_every_gravity():
    worn = familiarisation_setup(SEED, 0, 0).twin.truth.q_arm
    for level in (0.0, 1.0, 1.8):
        np.testing.assert_allclose(free_setup(SEED, 0, 0, level).twin.truth.q_arm, worn, atol=np.deg2rad(10.0))


def test_an_arm_falls_the_faster_the_more_it_weighs_and_slowly_under_water():
    sinks = {}
    for name, stage in {
        "0": free_setup(SEED, 0, 0, 0.0), "water": stage_of("water", level=0),
        "1": free_setup(SEED, 0, 0, 1.0), "1.8": free_setup(SEED, 0, 0, 1.8),
    }.items():  # fmt: skip
        stage.twin.put_surroundings(False)
        start = stage.own.fingertip(stage.twin.truth.q_arm)[2]
        sinks[name] = start - stage.own.fingertip(rested(stage, 0.15))[2]
    assert sinks["0"] < sinks["water"] < 0.3 * sinks["1"]
    assert sinks["1"] < sinks["1.8"]


@pytest.mark.slow
def test_an_identified_arm_leaves_less_than_the_table_and_the_machine_alone_most():
    left_over = [stage_of(name).left_over_Nm or 0.0 for name in ("dam", "table", "gcm")]
    assert left_over[0] < 0.5 * left_over[1]
    assert left_over[1] < 0.5 * left_over[2]

"""Every derivative in identification and control agrees with finite differences."""

import numpy as np
import pytest
from tests.shoulder_path import FURTHER_PATH

from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample

STEP = 1e-4  # of each parameter's own unit
TOLERANCE = 2e-6  # N·m per unit: fourth-order differences of torques of 30 N·m, whose closure is exact to 1e-10
STIFFER = 1e5  # times the stiffness of rig.toml: the arm hardly sags, and only the sag is non-linear
SAG_Nm = 1e-3  # remaining effect of the sag on torques of 30 N·m: about (10 N·m)² over 50 N·m/rad · STIFFER
LAYOUT = parameters.ParameterLayout(segments=2, freedoms=4, arms=1, joints=4)


@pytest.fixture(scope="module")
def model(assembly) -> ArmModel:
    none, one = np.zeros(4), np.ones(4)
    friction = Friction(2.0 * one, one, 1.3 * one, 0.06 * one, 0.1 * one, 0.05 * one, 0.02)
    gain = ActuatorGain(assembly.description.nominal_gain, none)
    return ArmModel(
        assembly,
        CalibratedMachine(gain, friction, friction, assembly.exo.phi, GRAVITY, 0.2 * one, none, none),
    )


def likely_parameters(assembly) -> np.ndarray:
    x = parameters.table_parameters(assembly.arm, np.full(4, 0.2), np.full(4, 2.0), np.full(4, 1.0))
    x[LAYOUT.stiffness], x[LAYOUT.spring_offset], x[LAYOUT.damping] = 1.5, 0.8, 0.4
    x[LAYOUT.fit] = [0.012, -0.009, 0.007, 0.02, 0.006, 0.2, -0.3, 0.12, 0.08, 0.008, -0.006, *FURTHER_PATH]
    return x


def differences(torque, x: np.ndarray) -> np.ndarray:
    """Fourth-order central differences (joint, parameter)."""
    columns = []
    for direction in STEP * np.eye(len(x)):
        near = torque(x + direction) - torque(x - direction)
        far = torque(x + 2 * direction) - torque(x - 2 * direction)
        columns.append((8 * near - far) / (12 * STEP))
    return np.column_stack(columns)


def assert_columns_agree(derivative: np.ndarray, expected: np.ndarray) -> None:
    for parameter, (ours, theirs) in enumerate(zip(derivative.T, expected.T, strict=True)):
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=TOLERANCE, err_msg=f"parameter {parameter}")


@pytest.mark.parametrize("seed", range(3))
def test_the_torque_of_a_motion_depends_on_every_parameter_as_differences_say(assembly, model, seed: int):
    generator = np.random.default_rng(seed)
    q = generator.uniform(*assembly.description.workspace)
    v, a = generator.uniform(-1.5, 1.5, 4), generator.uniform(-3.0, 3.0, 4)
    x = likely_parameters(assembly)

    def settled(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # The same sample is repeated: each repetition brings the sagged posture about ten times nearer.
        model.restart()
        sample = Sample(0.0, q, v, a, np.zeros(4))
        for _ in range(8):
            model.linearise(sample, x)
        return model.linearise(sample, x)

    assert_columns_agree(settled(x)[1], differences(lambda x: settled(x)[0], x))


def test_the_torque_at_rest_depends_on_every_parameter_as_differences_say(assembly, model):
    q = np.array([0.8, 0.3, -0.2, 1.3])
    x = likely_parameters(assembly)
    assert_columns_agree(model.at_rest(q, x)[1], differences(lambda x: model.at_rest(q, x)[0], x))


def test_the_torque_at_rest_knows_neither_springs_nor_speed(assembly, model):
    q = np.array([0.8, 0.3, -0.2, 1.3])
    x = likely_parameters(assembly)
    _, derivative = model.at_rest(q, x)
    for unknown in (LAYOUT.stiffness, LAYOUT.spring_offset, LAYOUT.damping, LAYOUT.viscous):
        np.testing.assert_array_equal(derivative[:, unknown], 0.0)


def test_in_stiff_cuffs_the_torque_is_linear_in_all_but_the_fit(assembly, model):
    # Friction depends on the absolute load, which is non-linear; without load-dependent friction the torque is linear.
    none = np.zeros(4)
    friction = Friction(none, none, none + 1.0, none, none, none + 0.05, 0.02)
    machine = CalibratedMachine(
        model.machine.actuators, friction, friction, assembly.exo.phi, GRAVITY, none, none, none
    )
    straight = ArmModel(assembly, machine)
    sample = Sample(0.0, np.array([0.8, 0.3, -0.2, 1.3]), np.full(4, 0.7), np.full(4, -1.2), none)
    x = likely_parameters(assembly)
    x[LAYOUT.fit][5:7] = np.log(STIFFER)
    change = 0.1 * np.random.default_rng(0).normal(size=len(x))
    change[LAYOUT.fit] = 0.0
    tau, derivative = straight.linearise(sample, x)
    changed, _ = straight.linearise(sample, x + change)
    np.testing.assert_allclose(changed, tau + derivative @ change, atol=SAG_Nm)

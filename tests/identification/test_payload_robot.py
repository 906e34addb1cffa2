"""The unloaded robot is identified from its log: torque, friction and residual."""

import numpy as np
import pytest

from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S
from exograv.identification.core.interface import Sample
from exograv.identification.payload.payload import PAYLOAD, PayloadModel
from exograv.identification.payload.robot_from_log import RobotFromLog, felt_covariance, robot_from_log
from exograv.model.urdf import read_urdf

URDF = """<robot name="one"><link name="base"/>
<joint name="lift" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="50" velocity="3"/></joint>
<link name="rod"><inertial><origin xyz="0.2 0 0"/><mass value="3"/>
<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
COULOMB, VISCOUS, ROTOR, OFFSET = 1.5, 0.8, 0.4, 0.3
HEAVIER = 1.25  # the true rod against its description
NOISE_SD = 0.4  # N·m, white
DT = 0.01


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> PayloadModel:
    path = tmp_path_factory.mktemp("one") / "one.urdf"
    path.write_text(URDF)
    return PayloadModel(read_urdf(path), "rod")


@pytest.fixture(scope="module")
def truth(model: PayloadModel) -> np.ndarray:
    x = np.zeros(model.n_parameters)
    x[model.blocks.links] = HEAVIER * model.tree.phi.ravel()
    for block, value in (
        (model.blocks.coulomb, COULOMB),
        (model.blocks.viscous, VISCOUS),
        (model.blocks.rotor, ROTOR),
        (model.blocks.asymmetry, OFFSET),
    ):
        x[block] = value
    return x


@pytest.fixture(scope="module")
def samples(model: PayloadModel, truth: np.ndarray) -> list[Sample]:
    noise = np.random.default_rng(0).normal(0.0, NOISE_SD, 4000)
    recorded = []
    for k in range(4000):
        t = DT * k
        q = np.sin(t) + 0.5 * np.sin(2.3 * t)
        v, a = np.cos(t) + 1.15 * np.cos(2.3 * t), -np.sin(t) - 2.645 * np.sin(2.3 * t)
        s = Sample(t, np.array([q]), np.array([v]), np.array([a]), np.zeros(1))
        s.tau = model.linearise(s, truth)[0] + noise[k]
        recorded.append(s)
    return recorded


@pytest.fixture(scope="module")
def found(model: PayloadModel, samples: list[Sample]) -> RobotFromLog:
    return robot_from_log(model, samples)


def test_friction_is_found_within_its_interval(model: PayloadModel, truth: np.ndarray, found: RobotFromLog):
    sd = np.sqrt(np.diag(found.covariance))
    for block in (model.blocks.coulomb, model.blocks.viscous, model.blocks.asymmetry):
        np.testing.assert_array_less(np.abs(found.x - truth)[block], 3 * sd[block])
        assert np.all(sd[block] < 0.2)


def test_the_torque_of_a_new_posture_is_right_though_the_description_is_not(
    model: PayloadModel, truth: np.ndarray, found: RobotFromLog
):
    for q in (-1.0, 0.2, 1.2):
        s = Sample(0.0, np.array([q]), np.array([0.5]), np.array([1.0]), np.zeros(1))
        # A tenth of the weight is 0.6 N·m; the description alone has an error of 1.5 N·m.
        np.testing.assert_allclose(model.linearise(s, found.x)[0], model.linearise(s, truth)[0], atol=0.3)


def test_what_is_left_over_is_the_noise_of_a_mean_and_lasts_one_mean(found: RobotFromLog):
    np.testing.assert_allclose(found.residual_sd, NOISE_SD / np.sqrt(SAMPLE_PERIOD_S / DT), rtol=0.1)
    assert found.correlation_s[0] < 2 * SAMPLE_PERIOD_S


def test_no_payload_is_read_into_an_unloaded_log(found: RobotFromLog):
    np.testing.assert_array_equal(found.x[PAYLOAD], 0.0)
    np.testing.assert_array_equal(found.covariance[PAYLOAD], 0.0)


def test_leaving_out_what_is_not_felt_changes_no_torques_uncertainty(
    model: PayloadModel, found: RobotFromLog, samples: list[Sample]
):
    felt = felt_covariance(model, found, found.covariance, samples)
    assert np.linalg.matrix_rank(felt, tol=1e-12) < np.linalg.matrix_rank(found.covariance, tol=1e-12)
    for s in samples[::400]:
        row = model.linearise(s, found.x)[1]
        np.testing.assert_allclose(
            np.sqrt(np.diag(row @ felt @ row.T)),
            np.sqrt(np.diag(row @ found.covariance @ row.T)),
            atol=0.1 * float(found.residual_sd[0]),
        )

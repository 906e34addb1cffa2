"""A payload adds the torque of its mass at its frame, and only that."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.errors import ModelError
from exograv.identification.core.interface import Sample
from exograv.identification.payload.payload import PAYLOAD, PayloadModel, about_body, payload_prior
from exograv.model.tree import Frame, inertial_parameters, is_physical
from exograv.model.urdf import read_urdf

URDF = """<robot name="two"><link name="base"/>
<joint name="lift" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.5"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="50" velocity="3"/></joint>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="3"/>
<inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0" rpy="0.3 0 0"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="30" velocity="3"/></joint>
<link name="lower"><inertial><origin xyz="0.15 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0.3 0.02 0" rpy="0.1 1.2 -0.4"/>
</joint>{tool}</robot>"""
MASS, COM, INERTIA = 1.5, np.array([0.02, -0.05, 0.1]), np.diag([0.01, 0.012, 0.008])
TOOL = """<link name="tool"><inertial><origin xyz="0.02 -0.05 0.1"/><mass value="1.5"/>
<inertia ixx="0.01" iyy="0.012" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
REAL = st.floats(-2.0, 2.0)


def model(folder: Path, tool: str, frame: str = "tool") -> PayloadModel:
    path = folder / "two.urdf"
    path.write_text(URDF.format(tool=tool))
    return PayloadModel(read_urdf(path), frame)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> PayloadModel:
    return model(tmp_path_factory.mktemp("bare"), '<link name="tool"/>')


@pytest.fixture(scope="module")
def with_tool(tmp_path_factory: pytest.TempPathFactory) -> PayloadModel:
    return model(tmp_path_factory.mktemp("tool"), TOOL)


def robot(of: PayloadModel, friction: float = 0.0) -> np.ndarray:
    x = np.zeros(of.n_parameters)
    x[of.blocks.links] = of.tree.phi.ravel()
    x[of.blocks.rotor.start :] = friction
    return x


def sample(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> Sample:
    return Sample(0.0, q, v, a, np.zeros(2))


@settings(max_examples=25)
@given(st.lists(REAL, min_size=6, max_size=6))
def test_a_payload_is_the_same_as_a_heavier_link_in_the_description(
    bare: PayloadModel, with_tool: PayloadModel, motion: list[float]
):
    moment = sample(*np.array(motion).reshape(3, 2))
    x = robot(bare)
    x[PAYLOAD] = inertial_parameters(MASS, COM, INERTIA)
    np.testing.assert_allclose(
        bare.linearise(moment, x)[0], with_tool.linearise(moment, robot(with_tool))[0], atol=1e-9
    )


def test_the_derivative_is_that_of_finite_differences_even_where_friction_grows_with_the_load(bare: PayloadModel):
    moment = sample(np.array([0.3, -0.7]), np.array([0.5, -0.4]), np.array([1.0, 2.0]))
    x = robot(bare, friction=0.2)
    x[PAYLOAD] = inertial_parameters(MASS, COM, INERTIA)
    derivative, step = bare.linearise(moment, x)[1], 1e-6
    for i, unit in enumerate(np.eye(len(x))):
        ahead, behind = (bare.linearise(moment, x + sign * step * unit)[0] for sign in (1, -1))
        np.testing.assert_allclose(derivative[:, i], (ahead - behind) / (2 * step), atol=1e-7)


def test_a_frame_that_is_its_body_leaves_the_parameters_alone():
    np.testing.assert_allclose(about_body(Frame(0, np.eye(3), np.zeros(3))), np.eye(10), atol=1e-15)


def test_moving_the_origin_keeps_mass_and_shifts_the_first_moment():
    moved = about_body(Frame(0, np.eye(3), np.array([0.1, 0.2, 0.3]))) @ inertial_parameters(MASS, COM, INERTIA)
    np.testing.assert_allclose(moved, inertial_parameters(MASS, COM + np.array([0.1, 0.2, 0.3]), INERTIA), atol=1e-12)


def test_direction_is_unknown_at_rest_and_known_in_clear_motion(bare: PayloadModel):
    x = robot(bare)
    x[bare.blocks.coulomb] = [2.0, 1.0]
    still = np.zeros(2)
    bare.linearise(sample(still, still, still), x)
    np.testing.assert_allclose(bare.direction_uncertainty(still), [2.0, 1.0])
    assert np.all(bare.direction_uncertainty(np.array([-1.0, 30.0])) < 1e-6)


def test_the_prior_is_a_possible_body_that_weighs_next_to_nothing_and_may_weigh_kilograms():
    mean, covariance = payload_prior()
    assert is_physical(mean)
    assert mean[0] < 0.05 * np.sqrt(covariance[0, 0])


def test_a_payload_on_the_base_is_refused_with_the_frames_that_move(tmp_path: Path):
    with pytest.raises(ModelError, match="Moving frames: lower, tool, upper"):
        model(tmp_path, '<link name="tool"/>', frame="base")

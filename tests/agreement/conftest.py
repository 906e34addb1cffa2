"""Fixtures: two other engines that read the same URDF text and share no code with the package."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports] - found through a path file
import pytest

from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.tree import Tree, inertia_about_origin

WEARER = Body(1.75, 75.0, "male", {"upper_arm": 0.305, "forearm": 0.262})


class PinocchioTree:
    """Model of a URDF in Pinocchio, with joints in the order of `joints`."""

    def __init__(self, text: str, joints: Sequence[str]):
        self.model = pinocchio.buildModelFromXML(text)
        self.data = self.model.createData()
        self.ids = [self.model.getJointId(name) for name in joints]
        self.columns = [self.model.joints[i].idx_v for i in self.ids]

    def configuration(self, q: np.ndarray) -> np.ndarray:
        """Coordinates of Pinocchio: a continuous joint is a point on the unit circle."""
        own = pinocchio.neutral(self.model)
        for i, angle in zip(self.ids, q, strict=True):
            joint = self.model.joints[i]
            own[joint.idx_q : joint.idx_q + joint.nq] = angle if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
        return own

    def ordered(self, values: np.ndarray) -> np.ndarray:
        """Joint values in the order of Pinocchio."""
        own = np.zeros(self.model.nv)
        own[self.columns] = values
        return own

    def torque(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Inverse dynamics [N·m]."""
        own = pinocchio.rnea(self.model, self.data, self.configuration(q), self.ordered(v), self.ordered(a))
        return own[self.columns]

    def gravity_torque(self, q: np.ndarray) -> np.ndarray:
        """Torque of the tree at rest [N·m]."""
        return self.torque(q, np.zeros(len(q)), np.zeros(len(q)))

    def potential_energy(self, q: np.ndarray) -> float:
        """Potential energy in gravity [J]."""
        return pinocchio.computePotentialEnergy(self.model, self.data, self.configuration(q))

    def body_phi(self, i: int) -> np.ndarray:
        """Inertial parameters (10,) of the body that joint i moves."""
        return self.model.inertias[self.ids[i]].toDynamicParameters()

    def pose(self, q: np.ndarray, frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Rotation and origin [m] of a frame in the base frame."""
        pinocchio.framesForwardKinematics(self.model, self.data, self.configuration(q))
        placement = self.data.oMf[self.model.getFrameId(frame)]
        return placement.rotation.copy(), placement.translation.copy()

    def jacobian(self, q: np.ndarray, frame: str) -> np.ndarray:
        """Velocity of the frame's origin, then angular velocity, in the base frame, per joint velocity (6, joint)."""
        own = pinocchio.computeFrameJacobian(
            self.model,
            self.data,
            self.configuration(q),
            self.model.getFrameId(frame),
            pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )
        return own[:, self.columns]


class MujocoTree:
    """Model of a URDF in MuJoCo, without constraints, with joints in the order of `joints`."""

    def __init__(self, text: str, joints: Sequence[str]):
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.data = mujoco.MjData(self.model)
        self.columns = [self.model.joint(name).id for name in joints]

    def torque(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Inverse dynamics [N·m]."""
        for own, values in ((self.data.qpos, q), (self.data.qvel, v), (self.data.qacc, a)):
            own[self.columns] = values
        mujoco.mj_inverse(self.model, self.data)
        return self.data.qfrc_inverse[self.columns].copy()


def urdf_text(tree: Tree, bodies: np.ndarray) -> str:
    """URDF of a tree with these inertial parameters (body, 10); frames are fixed links, massless bodies bare links."""
    lines = [f'<robot name="{tree.name}">', '<link name="base"/>']
    links = [f"body_of_{joint.name}" for joint in tree.joints]
    for joint, link, phi in zip(tree.joints, links, bodies, strict=True):
        parent = links[joint.parent] if joint.parent >= 0 else "base"
        lines.append(f'<link name="{link}">{_inertial(phi)}</link>')
        lines.append(
            f'<joint name="{joint.name}" type="{joint.kind}"><parent link="{parent}"/><child link="{link}"/>'
            f'<origin xyz="{_numbers(joint.p_parent_joint)}" rpy="{_numbers(_rpy(joint.R_parent_joint))}"/>'
            f'<axis xyz="{_numbers(joint.axis)}"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
        )
    for name, frame in tree.frames.items():
        parent = links[frame.body] if frame.body >= 0 else "base"
        if name != "base":
            lines.append(f'<link name="{name}"/>')
            lines.append(
                f'<joint name="to_{name}" type="fixed"><parent link="{parent}"/><child link="{name}"/>'
                f'<origin xyz="{_numbers(frame.p_body_frame)}" rpy="{_numbers(_rpy(frame.R_body_frame))}"/></joint>'
            )
    return "\n".join([*lines, "</robot>"])


def _inertial(phi: np.ndarray) -> str:
    mass = phi[0]
    if mass == 0.0:
        return ""
    com = phi[1:4] / mass
    inertia = inertia_about_origin(phi) - mass * (com @ com * np.eye(3) - np.outer(com, com))
    entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
    moments = " ".join(f'{name}="{float(inertia[entry])!r}"' for name, entry in entries.items())
    return f'<inertial><origin xyz="{_numbers(com)}"/><mass value="{float(mass)!r}"/><inertia {moments}/></inertial>'


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _rpy(R: np.ndarray) -> np.ndarray:
    return pinocchio.rpy.matrixToRpy(R)


@pytest.fixture(scope="session")
def make_pinocchio() -> Callable[[str, Sequence[str]], PinocchioTree]:
    return PinocchioTree


@pytest.fixture(scope="session")
def make_mujoco() -> Callable[[str, Sequence[str]], MujocoTree]:
    return MujocoTree


@pytest.fixture(scope="session")
def write_urdf() -> Callable[[Tree, np.ndarray], str]:
    return urdf_text


@pytest.fixture(scope="session")
def make_random_urdf() -> Callable[[int], str]:
    return random_urdf


@pytest.fixture(scope="session")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), WEARER)


@pytest.fixture(scope="session", params=["right", "left"])
def either_assembly(request: pytest.FixtureRequest) -> Assembly:
    return assemble(load_rig("recupera_like", request.param), WEARER)


def random_urdf(seed: int) -> str:
    """URDF of a branched tree of six links on joints of all kinds, half of them with fixed links."""
    generator = np.random.default_rng(seed)
    lines = [f'<robot name="random_{seed}">', '<link name="base"/>']
    for i in range(6):
        parent = "base" if i == 0 else f"link{generator.integers(0, i)}"
        lines.append(_random_link(generator, f"link{i}"))
        lines.append(_random_joint(generator, f"joint{i}", ("revolute", "prismatic", "continuous")[i % 3], parent, i))
        if generator.random() < 0.5:
            lines.append(_random_link(generator, f"extra{i}"))
            lines.append(_random_joint(generator, f"fixed{i}", "fixed", f"link{i}", i, child=f"extra{i}"))
    return "\n".join([*lines, "</robot>"])


def _random_link(generator: np.random.Generator, name: str) -> str:
    points = generator.normal(0.0, 0.1, (5, 3))
    points -= points.mean(axis=0)
    mass = generator.uniform(0.5, 3.0)
    inertia = mass / 5 * np.sum([p @ p * np.eye(3) - np.outer(p, p) for p in points], axis=0)
    com, rpy = generator.normal(0.0, 0.1, 3), generator.uniform(-3.0, 3.0, 3)
    entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
    moments = " ".join(f'{key}="{float(inertia[entry])!r}"' for key, entry in entries.items())
    return (
        f'<link name="{name}"><inertial><origin xyz="{_numbers(com)}" rpy="{_numbers(rpy)}"/>'
        f'<mass value="{mass!r}"/><inertia {moments}/></inertial></link>'
    )


def _random_joint(
    generator: np.random.Generator, name: str, kind: str, parent: str, i: int, child: str | None = None
) -> str:
    axis = generator.normal(size=3)
    limit = '<limit lower="-2" upper="2" effort="50" velocity="5"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child or f"link{i}"}"/>'
        f'<origin xyz="{_numbers(generator.normal(0.0, 0.3, 3))}" rpy="{_numbers(generator.uniform(-3.0, 3.0, 3))}"/>'
        f'<axis xyz="{_numbers(axis / np.linalg.norm(axis))}"/>{"" if kind == "fixed" else limit}</joint>'
    )

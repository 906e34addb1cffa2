"""Writer of machine, arm and cuffs as MJCF, MuJoCo's own format.

A cuff is a nearly massless body on the machine, with three slides and three hinges that have the cuff's springs. The
body is welded to the arm's segment. Each direction then has its own stiffness, which a soft weld cannot provide.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .personal import CuffHold, Personal
from .tree import Joint, Tree
from .urdf_writer import mass_centre_inertia, words

Vector = Float[np.ndarray, " 3"]

CUFF_MASS, CUFF_INERTIA = 1e-3, 1e-6
"""Mass [kg] and inertia [kg·m²] of a cuff's body; its weight is compensated."""
CUFF_DAMPING, CUFF_DAMPING_ROTATION = 60.0, 0.15
"""Damping of a cuff [N·s/m], [N·m·s/rad]: assumed, so that the arm settles; it is not identified."""
CUFF_ARMATURE, CUFF_ARMATURE_ROTATION = 0.05, 1e-3
"""Armature of the cuff's joints [kg], [kg·m²]: keeps the springs slow against the time step; no effect at rest."""
TIMESTEP_S = 0.0005
WELD = 'solref="0.002 1" solimp="0.9999 0.9999 0.001 0.5 2"'
"""Options of the weld: as stiff as the time step allows, so that the springs deform and not the weld."""


@dataclass(frozen=True)
class ArmSprings:
    """Elasticity of the wearer's joints, by joint of the arm's tree."""

    stiffness: Mapping[str, float]
    """Stiffness of each freedom of the arm [N·m/rad]."""
    neutral: Mapping[str, float]
    """Neutral angle of each freedom of the arm [rad]."""
    damping: Mapping[str, float]
    """Damping of each freedom of the arm [N·m·s/rad]."""


@dataclass(frozen=True)
class Posture:
    """Posture in which the cuffs are fastened, by joint [rad] or [m]; joints that are not named are at zero."""

    positions: Mapping[str, float]


def mjcf_text(
    personal: Personal,
    springs: ArmSprings,
    rotor: Float[np.ndarray, " joint"],
    gravity: Vector,
    shifts: Mapping[str, float],
    donned: Posture,
) -> str:
    """Write both trees, the cuffs, a motor at each joint of the machine and a key frame `donned`.

    Args:
        personal: Machine and arm.
        springs: Springs of the arm's joints.
        rotor: Rotor inertias, reflected to the machine's joints [kg·m²].
        gravity: Gravity in the machine's base frame [m/s²].
        shifts: Fixed positions of the joints that shift a shoulder's centre [m]; in MuJoCo no joint can follow two
            others.
        donned: Posture of the key frame.
    """
    exo, arm = personal.exo, personal.arm
    order: list[str] = []
    rotors = {name: f'armature="{value!r}"' for name, value in zip(exo.joint_names, rotor.tolist(), strict=True)}
    machine = _Writer(exo, _by_exo_body(personal), rotors, "exo_", order)
    limb = _Writer(arm, {}, {name: _spring(springs, name) for name in springs.stiffness}, "arm_", order)
    bases = iter(personal.bases.values())
    body = [
        *machine.bodies(-1, np.zeros(3), 4),
        *(line for root in _roots(arm) for line in limb.group(root, next(bases), 4)),
    ]
    motors = (
        f'    <motor name="{joint.name}" joint="{joint.name}" ctrlrange="{-joint.effort!r} {joint.effort!r}"/>'
        for joint in exo.joints
        if np.isfinite(joint.effort)
    )
    welds = (
        f'    <weld name="{cuff.name}" site1="{cuff.name}_strap" site2="arm_{cuff.arm_frame}" {WELD}/>'
        for cuff in personal.cuffs
    )
    held = (
        f'    <joint name="{name}" joint1="{name}" polycoef="{at!r} 0 0 0 0" {WELD}/>' for name, at in shifts.items()
    )
    positions = words(np.array([donned.positions.get(name, 0.0) for name in order]))
    return "\n".join(
        [
            f'<mujoco model="{exo.name}">',
            '  <compiler angle="radian" autolimits="true"/>',
            f'  <option timestep="{TIMESTEP_S}" gravity="{words(gravity)}" integrator="implicitfast"/>',
            "  <worldbody>",
            *machine.sites([-1], 4),
            *body,
            "  </worldbody>",
            "  <equality>",
            *welds,
            *held,
            "  </equality>",
            "  <actuator>",
            *motors,
            "  </actuator>",
            "  <keyframe>",
            f'    <key name="donned" qpos="{positions}"/>',
            "  </keyframe>",
            "</mujoco>",
            "",
        ]
    )


def _by_exo_body(personal: Personal) -> dict[int, list[CuffHold]]:
    held: dict[int, list[CuffHold]] = {}
    for cuff in personal.cuffs:
        held.setdefault(personal.exo.frame(cuff.exo_frame).body, []).append(cuff)
    return held


def _spring(springs: ArmSprings, name: str) -> str:
    return (
        f'stiffness="{springs.stiffness[name]!r}" springref="{springs.neutral[name]!r}" '
        f'damping="{springs.damping[name]!r}"'
    )


def _roots(tree: Tree) -> Iterator[int]:
    return (i for i, joint in enumerate(tree.joints) if joint.parent < 0)


@dataclass
class _Writer:
    """Writer of one tree as nested bodies; joints of massless bodies move the next body with mass."""

    tree: Tree
    cuffs: Mapping[int, Sequence[CuffHold]]
    """Cuffs by the body that carries them; -1 is the base."""
    attributes: Mapping[str, str]
    """MJCF attributes of each joint, by the joint's name."""
    prefix: str
    """Prefix of the names of sites."""
    order: list[str]
    """Names of joints in the order of writing."""

    def bodies(self, parent: int, offset: Vector, indent: int) -> Iterator[str]:
        """Write all children of a body, shifted by `offset` [m] from the tree's positions."""
        for cuff in self.cuffs.get(parent, ()):
            yield from self._cuff(cuff, indent)
        for i, joint in enumerate(self.tree.joints):
            if joint.parent == parent:
                yield from self.group(i, offset, indent)

    def group(self, first: int, offset: Vector, indent: int) -> Iterator[str]:
        """Write the joints up to the next body with mass, as one body with several joints."""
        members = self._members(first)
        joint, last, space = self.tree.joints[first], members[-1], " " * indent
        place = _place(joint.R_parent_joint, offset + joint.p_parent_joint)
        yield f'{space}<body name="body_of_{self.tree.joints[last].name}" {place}>'
        yield f"{space}  {_inertial(self.tree.phi[last])}"
        for i in members:
            yield f"{space}  {self._joint(self.tree.joints[i])}"
        yield from self.sites(members, indent + 2)
        yield from self.bodies(last, np.zeros(3), indent + 2)
        yield f"{space}</body>"

    def sites(self, bodies: Sequence[int], indent: int) -> Iterator[str]:
        """Write the frames of these bodies as sites."""
        for name, frame in self.tree.frames.items():
            if frame.body in bodies and name != "base":
                place = _place(frame.R_body_frame, frame.p_body_frame)
                yield f'{" " * indent}<site name="{self.prefix}{name}" {place}/>'

    def _members(self, first: int) -> list[int]:
        members = [first]
        while self.tree.phi[members[-1], 0] == 0.0:
            following = [i for i, joint in enumerate(self.tree.joints) if joint.parent == members[-1]]
            members.append(following[0])
        return members

    def _joint(self, joint: Joint) -> str:
        self.order.append(joint.name)
        kind = "hinge" if joint.kind == "revolute" else "slide"
        return (
            f'<joint name="{joint.name}" type="{kind}" axis="{words(joint.axis)}" '
            f"{_range(joint)}{self.attributes.get(joint.name, '')}/>"
        )

    def _cuff(self, cuff: CuffHold, indent: int) -> Iterator[str]:
        frame, space = self.tree.frame(cuff.exo_frame), " " * indent
        yield f'{space}<body name="{cuff.name}" {_place(frame.R_body_frame, frame.p_body_frame)} gravcomp="1">'
        yield f'{space}  <inertial pos="0 0 0" mass="{CUFF_MASS}" diaginertia="{words(np.full(3, CUFF_INERTIA))}"/>'
        for k, stiffness in enumerate(cuff.stiffness.tolist()):
            name = f"{cuff.name}_{'about_' if k > 2 else ''}{'xyz'[k % 3]}"
            self.order.append(name)
            kind, damping, armature = (
                ("slide", CUFF_DAMPING, CUFF_ARMATURE)
                if k < 3
                else ("hinge", CUFF_DAMPING_ROTATION, CUFF_ARMATURE_ROTATION)
            )
            axis = words(np.eye(3)[k % 3])
            yield (
                f'{space}  <joint name="{name}" type="{kind}" axis="{axis}" stiffness="{stiffness!r}" '
                f'damping="{damping}" armature="{armature}"/>'
            )
        yield f'{space}  <site name="{cuff.name}_strap"/>'
        yield f"{space}</body>"


def _range(joint: Joint) -> str:
    return f'range="{joint.lower!r} {joint.upper!r}" ' if np.isfinite([joint.lower, joint.upper]).all() else ""


def _place(R: Float[np.ndarray, "3 3"], p: Vector) -> str:
    return f'pos="{words(p)}" xyaxes="{words(R[:, :2].T.ravel())}"'


def _inertial(phi: Float[np.ndarray, " 10"]) -> str:
    mass, com, inertia = mass_centre_inertia(phi)
    entries = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    return f'<inertial pos="{words(com)}" mass="{mass!r}" fullinertia="{words(np.array(entries))}"/>'

"""Shapes of a machine whose files hold no meshes: drives, links around the limbs, cuffs, and the stand.

Joint frames of an exoskeleton often lie inside the wearer, where the axes meet the limb's joints. The drives are drawn
on the same axes, but outside of the limb, at the height of the centres of mass of the two links.
"""

from dataclasses import dataclass

import numpy as np

from exograv.model.description import Cuff, RigDescription
from exograv.model.tree import Tree, Vector

from .description import BASE, Point, Role, Shape, point_of
from .person_shapes import Seat
from .poses import ORIGIN, Pose

DRIVE_MIN_M = {"shoulder": 0.085, "elbow": 0.062, "forearm": 0.055, "wrist": 0.045}
"""Smallest distance of a drive from the joint's centre, so that it lies outside of the limb [m]."""

HINT_M = 0.03
"""Offset of a centre of mass that tells on which side of the limb the drive is [m]."""

DRIVE_RADIUS_M = {"shoulder": 0.042, "elbow": 0.034, "forearm": 0.026, "wrist": 0.022}
BEARING = 0.6
"""Size of a joint without a motor, as a share of a drive's."""

LINK_RADIUS_M, END_LINK_RADIUS_M, STAND_RADIUS_M = 0.016, 0.011, 0.03
RING_THICKNESS_M, CUFF_HALF_LENGTH_M = 0.012, 0.028
CLEARANCE_M = 0.02
"""Gap between a limb and the machine's shapes around it [m]."""

ALONG_COSINE, ALONG_M = 0.94, 0.05
"""Axis that runs along a limb: largest angle 20°, largest distance [m]. Its drive is a ring around the limb."""

RING_AT = 0.3
"""Place of such a ring, as a share of the limb's length."""


@dataclass(frozen=True)
class LimbLine:
    """Segment of the wearer in the posture in which the cuffs are fastened, in the base [m]."""

    start: Vector
    end: Vector
    radius: float

    def nearest(self, point: Vector) -> Vector:
        """Nearest point on the segment's line, between its ends."""
        along = self.end - self.start
        share = np.clip((point - self.start) @ along / (along @ along), 0.0, 1.0)
        return self.start + share * along


@dataclass(frozen=True)
class Attachment:
    """Drive of a joint in the base: its centre on the joint's axis, and the radius of a ring around a limb."""

    centre: Vector
    axis: Vector
    ring: float
    """Radius of the ring [m]; 0 for a drive beside the limb."""

    def toward(self, point: Vector) -> Vector:
        """Place where a link to `point` begins."""
        if self.ring == 0.0:
            return self.centre
        across = point - self.centre
        across = across - self.axis * (across @ self.axis)
        length = float(np.linalg.norm(across))
        return self.centre + (self.ring * across / length if length > 1e-6 else 0.0 * across)


class MachineShapes:
    """Builder of the shapes. All work is done in the base, at the posture in which the cuffs are fastened."""

    def __init__(self, description: RigDescription, tree: Tree, poses: list[Pose], limbs: list[LimbLine], seat: Seat):
        self._description, self._tree, self._poses, self._limbs, self._seat = description, tree, poses, limbs, seat
        self._centres = [self._centre_of_mass(body) for body in range(len(tree.joints))]
        self._drives = [self._attachment(joint) for joint in range(len(tree.joints))]

    def shapes(self, drawn: frozenset[int]) -> list[Shape]:
        """Shapes of all bodies except the `drawn` ones, which have shapes of their own."""
        shapes = [] if BASE in drawn else self._stand()
        for number, joint in enumerate(self._tree.joints):
            if number not in drawn:
                shapes += self._link(number)
            if number not in drawn and joint.parent not in drawn:
                shapes.append(self._drive(number))
        return shapes + [self._cuff(cuff) for cuff in self._description.settings.cuffs]

    def _centre_of_mass(self, body: int) -> Vector:
        mass, *moment = self._tree.phi[body, :4]
        return self._poses[body].of(np.array(moment) / mass if mass > 0.0 else np.zeros(3))

    def _attachment(self, number: int) -> Attachment:
        joint, pose = self._tree.joints[number], self._poses[number]
        axis, origin = pose.R @ joint.axis, pose.p
        limb = self._limb_along(axis, origin)
        if limb is not None:
            place = limb.start + RING_AT * (limb.end - limb.start)
            return Attachment(origin + axis * ((place - origin) @ axis), axis, limb.radius + CLEARANCE_M)
        bodies = [number, *([joint.parent] if joint.parent >= 0 else [])]
        offset = max(((self._centres[body] - origin) @ axis for body in bodies), key=abs)
        least = DRIVE_MIN_M[self._description.places[number]]
        if abs(offset) < least:
            # Without a hint by the masses: beside the arm, behind it, or above it.
            preferred = np.array([-0.5, self._outward(origin), 0.3])
            offset = least * np.sign(offset if abs(offset) > HINT_M else axis @ preferred)
        return Attachment(origin + offset * axis, axis, 0.0)

    def _limb_along(self, axis: Vector, origin: Vector) -> LimbLine | None:
        for limb in self._limbs:
            along = (limb.end - limb.start) / np.linalg.norm(limb.end - limb.start)
            to_middle = 0.5 * (limb.start + limb.end) - origin
            distance = np.linalg.norm(to_middle - axis * (axis @ to_middle))
            if abs(along @ axis) > ALONG_COSINE and distance < ALONG_M:
                return limb
        return None

    def _outward(self, point: Vector) -> float:
        return float(np.sign(point[1] - self._seat.shoulders[1]))

    def _outside(self, point: Vector) -> Vector:
        """Nearest point outside of all limbs."""
        for limb in self._limbs:
            nearest = limb.nearest(point)
            away, least = point - nearest, limb.radius + CLEARANCE_M
            distance = float(np.linalg.norm(away))
            if distance < 1e-6:
                away, distance = np.array([0.0, self._outward(point), 0.0]), 1.0
                point = nearest + least * away
            elif distance < least:
                point = nearest + least * away / distance
        return point

    def _link(self, body: int) -> list[Shape]:
        """Link from its own drive past its centre of mass to the drives of its children and to its cuffs."""
        middle = self._outside(self._centres[body])
        children = [k for k, joint in enumerate(self._tree.joints) if joint.parent == body]
        ends = [self._drives[k].toward(middle) for k in children]
        radius = LINK_RADIUS_M if children else END_LINK_RADIUS_M
        rims = [self._rim(cuff, middle) for cuff in self._description.settings.cuffs if self._body_of(cuff) == body]
        lines = [(self._drives[body].toward(middle), middle), *((middle, end) for end in (*ends, *rims))]
        return [self._capsule(body, "machine", *line, radius) for line in lines]

    def _drive(self, number: int) -> Shape:
        joint, drive = self._tree.joints[number], self._drives[number]
        place = self._description.places[number]
        has_motor = self._description.settings.actuators[number].drive != "passive"
        share = 1.0 if has_motor else BEARING
        owner = joint.parent
        if drive.ring:
            points = self._in(owner, drive.centre, drive.centre + drive.axis)
            return Shape("ring", owner, "machine", points, (drive.ring, share * RING_THICKNESS_M))
        half = share * 0.75 * DRIVE_RADIUS_M[place] * drive.axis
        points = self._in(owner, drive.centre - half, drive.centre + half)
        role: Role = "drive" if has_motor else "machine"
        return Shape("cylinder", owner, role, points, (share * DRIVE_RADIUS_M[place],))

    def _body_of(self, cuff: Cuff) -> int:
        return self._tree.frame(cuff.exo_frame).body

    def _cuff_pose(self, cuff: Cuff) -> tuple[Vector, Vector, float]:
        """Centre and axis of a cuff in the base, and its radius."""
        frame = self._tree.frame(cuff.exo_frame)
        pose = self._pose(frame.body)
        centre, axis = pose.of(frame.p_body_frame), pose.R @ frame.R_body_frame[:, 2]
        radius = min(self._limbs, key=lambda limb: float(np.linalg.norm(limb.nearest(centre) - centre))).radius
        return centre, axis, radius

    def _rim(self, cuff: Cuff, point: Vector) -> Vector:
        centre, axis, radius = self._cuff_pose(cuff)
        return Attachment(centre, axis, radius).toward(point)

    def _cuff(self, cuff: Cuff) -> Shape:
        centre, axis, radius = self._cuff_pose(cuff)
        body, half = self._body_of(cuff), CUFF_HALF_LENGTH_M * axis
        return Shape("cylinder", body, "cuff", self._in(body, centre - half, centre + half), (radius + 0.007,))

    def _stand(self) -> list[Shape]:
        """Column behind the seat, with a bar to each drive on the base, and the seat."""
        seat, roots = self._seat, [k for k, joint in enumerate(self._tree.joints) if joint.parent < 0]
        back, middle, floor = seat.shoulders[0] - 0.24, seat.shoulders[1], seat.floor
        highest = max(self._drives[k].centre[2] for k in roots)
        foot, top = np.array([back, middle, floor + 0.02]), np.array([back, middle, highest])
        shapes = [self._capsule(BASE, "stand", foot, top, STAND_RADIUS_M)]
        for k in roots:
            end = self._drives[k].centre
            corner, beside = np.array([back, end[1], end[2]]), np.array([back, middle, end[2]])
            shapes += [self._capsule(BASE, "stand", beside, corner, 0.8 * STAND_RADIUS_M)]
            shapes += [self._capsule(BASE, "stand", corner, end, 0.8 * STAND_RADIUS_M)]
        x, y, z = seat.hips.tolist()
        boxes = [
            ((x + 0.10, y, z - 0.105), (0.46, 0.44, 0.05)),
            ((x - 0.135, y, z + 0.19), (0.045, 0.36, 0.44)),
            ((back + 0.1, y, floor + 0.02), (0.5, 0.5, 0.035)),
        ]
        shapes += [Shape("box", BASE, "stand", (centre,), (), size) for centre, size in boxes]
        under = self._capsule(BASE, "stand", np.array([x + 0.06, y, floor]), np.array([x + 0.06, y, z - 0.12]), 0.035)
        return [*shapes, under]

    def _pose(self, body: int) -> Pose:
        return self._poses[body] if body >= 0 else ORIGIN

    def _in(self, body: int, *points: Vector) -> tuple[Point, ...]:
        return tuple(point_of(self._pose(body).inverse_of(point)) for point in points)

    def _capsule(self, body: int, role: Role, start: Vector, end: Vector, radius: float) -> Shape:
        return Shape("capsule", body, role, self._in(body, start, end), (radius, radius))

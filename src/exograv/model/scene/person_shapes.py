"""Shapes of the seated person around the arms in the machine: trunk, head, legs, and the arm that hangs free."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exograv.model.anthropometry import TABLE, Body, segment_lengths
from exograv.model.rig_settings import ArmSide
from exograv.model.tree import Vector

from .description import BASE, Point, Role, Shape, point_of

# Shares of stature for the picture only: Drillis and Contini 1966, as in Winter 2009, Biomechanics, fig. 4.1.
TRUNK, THIGH, SHANK, FOOT_HEIGHT, FOOT = 0.288, 0.245, 0.246, 0.039, 0.152
"""Hip to shoulder, hip to knee, knee to ankle, height of the ankle, length of the foot."""

HEAD, SHOULDER_TO_TOP, SHOULDERS, HIPS = 0.130, 0.182, 0.226, 0.10
"""Chin to top, shoulder to top, distance of the shoulder centres, of the hip centres (the last two are assumed)."""

DENSITY = 1060.0
"""Density of a limb [kg/m³], middle of the values in Winter 2009, table 4.1."""

OUTWARD: Mapping[ArmSide, float] = {"right": -1.0, "left": 1.0}
"""Sign of y on each side."""


def limb_radius(body: Body, segment: str) -> float:
    """Radius of a cylinder with mass and length of a segment of the table [m]."""
    mass = body.mass_kg * TABLE[body.sex][segment].mass_percent / 100.0
    return float(np.sqrt(mass / (DENSITY * np.pi * segment_lengths(body)[segment])))


def arm_radius(body: Body) -> tuple[float, float, float, float]:
    """Radius at shoulder, elbow, wrist and finger tip [m]."""
    upper_arm, forearm = limb_radius(body, "upper_arm"), limb_radius(body, "forearm")
    return 1.15 * upper_arm, 0.5 * (upper_arm + forearm), 0.72 * forearm, 0.4 * forearm


@dataclass(frozen=True)
class Seat:
    """Place of the person: middle of the shoulders, hips and floor [m]."""

    shoulders: Vector
    hips: Vector
    floor: float


def seat_of(body: Body, shoulders: Mapping[ArmSide, Vector]) -> Seat:
    """Seat the person so that the shoulders are where the machine has them."""
    half = np.array([0.0, 0.5 * SHOULDERS * body.height_m, 0.0])
    middles = [point - OUTWARD[side] * half for side, point in shoulders.items()]
    middle = np.mean(middles if len(middles) == 1 else list(shoulders.values()), axis=0)
    hips = middle - np.array([0.03, 0.0, TRUNK * body.height_m])
    return Seat(middle, hips, float(hips[2] - (SHANK + FOOT_HEIGHT) * body.height_m))


def person_shapes(body: Body, seat: Seat, arms: Mapping[ArmSide, Vector]) -> list[Shape]:
    """Shapes of trunk, head and legs, and of each arm outside of the machine."""
    shapes = [*_trunk(body, seat), *_head(body, seat)]
    for side, sign in OUTWARD.items():
        shapes += _leg(body, seat, sign)
        if side not in arms:
            shapes += _free_arm(body, seat, sign)
    return shapes


def _trunk(body: Body, seat: Seat) -> list[Shape]:
    height = body.height_m
    width = 0.5 * SHOULDERS * height
    chest = seat.shoulders - np.array([0.02, 0.0, 0.075 * height])
    hips = seat.hips + np.array([0.0, 0.0, 0.035 * height])
    flat = (0.66, 1.0, 1.0)
    left, right = (seat.shoulders + np.array([-0.01, sign * 0.82 * width, -0.012]) for sign in (1.0, -1.0))
    return [
        _capsule("shirt", hips, chest, 0.087 * height, 0.105 * height, flat),
        _capsule("shirt", left, right, 0.034 * height, 0.034 * height),
        _capsule("trousers", seat.hips, seat.hips + np.array([0.0, 0.0, 0.02]), 0.09 * height, 0.088 * height, flat),
    ]


def _head(body: Body, seat: Seat) -> list[Shape]:
    height = body.height_m
    centre = seat.shoulders + np.array([0.015, 0.0, (SHOULDER_TO_TOP - 0.5 * HEAD) * height])
    radius = 0.5 * HEAD * height
    crown = centre + np.array([-0.014, 0.0, 0.016])
    nose = centre + np.array([0.8 * radius, 0.0, -0.12 * radius])
    return [
        _capsule("skin", seat.shoulders - np.array([0.015, 0.0, 0.01]), centre, 0.033 * height, 0.03 * height),
        Shape("ball", BASE, "skin", (point_of(centre),), (radius,), (0.86, 0.72, 1.0)),
        Shape("ball", BASE, "hair", (point_of(crown),), (radius,), (0.84, 0.745, 0.97)),
        Shape("ball", BASE, "skin", (point_of(nose),), (0.16 * radius,), (1.2, 0.8, 1.4)),
    ]


def _leg(body: Body, seat: Seat, sign: float) -> list[Shape]:
    height = body.height_m
    hip = seat.hips + np.array([0.01, sign * 0.5 * HIPS * height, 0.0])
    knee = hip + np.array([THIGH * height, sign * 0.02, 0.0])
    ankle = np.array([knee[0] - 0.02, knee[1], seat.floor + FOOT_HEIGHT * height])
    toe = ankle + np.array([0.72 * FOOT * height, sign * 0.02, 0.022 - FOOT_HEIGHT * height])
    heel = np.array([ankle[0] - 0.02, ankle[1], seat.floor + 0.028])
    return [
        _capsule("trousers", hip, knee, 0.047 * height, 0.034 * height),
        _capsule("trousers", knee, ankle, 0.034 * height, 0.023 * height),
        _capsule("hair", heel, toe, 0.026, 0.022),
    ]


def _free_arm(body: Body, seat: Seat, sign: float) -> list[Shape]:
    """Arm outside of the machine, with the hand on the thigh."""
    upper_arm, forearm, hand = segment_lengths(body).values()
    at_shoulder, at_elbow, at_wrist, _ = arm_radius(body)
    shoulder = seat.shoulders + np.array([0.0, sign * 0.5 * SHOULDERS * body.height_m, -0.005])
    elbow = shoulder + upper_arm * _unit(0.12, sign * 0.16, -1.0)
    wrist = elbow + forearm * _unit(1.0, -sign * 0.34, -0.34)
    tip = wrist + hand * _unit(1.0, -sign * 0.15, -0.32)
    thumb = np.array([0.0, -sign, 0.0])
    sleeve = shoulder + 0.55 * (elbow - shoulder)
    middle = 0.5 * (at_shoulder + at_elbow) + 0.006
    return [
        _capsule("skin", shoulder, elbow, at_shoulder, at_elbow),
        _capsule("shirt", shoulder, sleeve, at_shoulder + 0.006, middle),
        _capsule("skin", elbow, wrist, at_elbow, at_wrist),
        Shape("hand", BASE, "skin", (point_of(wrist), point_of(tip), point_of(thumb)), (at_wrist,)),
    ]


def _capsule(role: Role, start: Vector, end: Vector, r_start: float, r_end: float, size: Point | None = None) -> Shape:
    return Shape("capsule", BASE, role, (point_of(start), point_of(end)), (r_start, r_end), size)


def _unit(x: float, y: float, z: float) -> Vector:
    vector = np.array([x, y, z])
    return vector / np.linalg.norm(vector)

"""Map of an OpenSim arm from the names of its coordinates, for models whose names say what they are.

The elbow is found by its name. Everything above it follows from the model's geometry: the shoulder's coordinates turn
about one centre, gravity points down, and the elbow's axis points to the side.
"""

import re
from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError
from exograv.model.description import RigDescription
from exograv.model.limb import FREEDOMS
from exograv.model.rig_settings import FREEDOMS_OF_ARM, ArmSide
from exograv.rig.twin.wearer.regressions import SAMPLE, TABLE
from exograv.rig.twin.wearer.skeleton import axis_of

from .model_joints import listed
from .opensim.document import OsimCoordinate, OsimDocument
from .opensim.kinematics import OsimKinematics
from .wearer_map import WearerMap

Vector = Float[np.ndarray, " 3"]

NAMES = {
    "elbow": r"elbow(_flex(ion)?)?|el_x|(arm|forearm)_elbow_flex(ion)?",
    "forearm_roll": r"pro_sup|(forearm_)?pronation(_supination)?|pronosupination|ps_y",
    "wrist_flexion": r"(wrist_)?flex(ion)?|wrist_flexion_extension",
    "wrist_deviation": r"(wrist_)?dev(iation)?|wrist_radial_ulnar_deviation",
}
"""Names of coordinates, without their side. Source: Arm26, Rajagopal 2016, MoBL-ARMS 4.1, DAS3, Pose2Sim."""

PERSON_MASS_KG = (40.0, 200.0)
"""Mass of a model that is taken as that of a whole person [kg]; a lighter one is a part of a person."""

PERSON = {"height_m": 1.75, "mass_kg": 75.0, "sex": "male"}
"""Assumed person: the median man of Holzbaur 2005. OpenSim files state neither height nor sex."""

CENTRE_M = 0.02
"""Largest distance between the centres of two joints of one shoulder [m]: phantom bodies sit in the same place."""

HANGS = np.deg2rad(15.0)
"""Tilt up to which an upper arm hangs as the file has it [rad]; else the shoulder is turned until it does."""

ALONG = np.deg2rad(30.0)
"""Largest angle between a hinge and the freedom that it is [rad]; hinges farther off are a shoulder of their own."""

LEVEL_LEAST = 0.5
"""Smallest horizontal part of the elbow's axis in the hanging arm [-]."""

NEUTRAL_BELOW_DEG = -30.0
"""A forearm that turns below this angle counts from the palm facing the body, else from the palm facing forward."""


def map_by_names(document: OsimDocument, description: RigDescription) -> tuple[WearerMap, tuple[str, ...]]:
    """Return the map of a model's arm on the machine's side, and a note about what was assumed.

    Raises:
        ModelError: No coordinate of this side is named like an elbow, nothing turns the upper arm, or the elbow turns
            about a vertical axis.
    """
    return _Naming(document, description).map()


class _Naming:
    """Search for the parts of one arm."""

    def __init__(self, document: OsimDocument, description: RigDescription) -> None:
        self.document, self.kinematics = document, OsimKinematics(document)
        self.side: ArmSide = description.arm_sides[0]
        self.moved = FREEDOMS[: FREEDOMS_OF_ARM[description.settings.wearer.arm]]
        elbow = next(self._named("elbow"), None)
        if elbow is None:
            names = [one.name for _, one in document.coordinates()]
            raise ModelError(
                f"{document.path}: no coordinate of a {self.side} arm is named like an elbow (elbow_flexion, "
                f"elbow_flex_r, EL_x). Coordinates there: {listed(names)}. Give a map with --wearer-map "
                "(docs/howto/wearer_models.md)."
            )
        self.elbow, self.lower = elbow, self._body_of(elbow)
        beyond = {freedom: next(self._named(freedom, self.lower), None) for freedom in FREEDOMS[4:]}
        self.distal = {freedom: name for freedom, name in beyond.items() if name is not None}
        self.upper = document.joints[self.lower].parent
        self.shoulder = self._shoulder()
        self.hand = self._hand()
        self.roots = dict.fromkeys((*self.shoulder, self.elbow), 0.0)

    def map(self) -> tuple[WearerMap, tuple[str, ...]]:
        """Return the map and the note."""
        self._hang()
        axes = self._axes()
        content: dict[str, object] = {
            "title": f"{self.document.title} (OpenSim), mapped by its names",
            "side": self.side,
            **{name: _direction(axis) for name, axis in zip(("forward", "left", "up"), axes, strict=True)},
            "lock_others": True,
            "body": self._person(),
            "segments": {"upper_arm": self.upper, "forearm": self._forearm(), "hand": self.hand},
            "freedoms": {"elbow": {"joint": self.elbow, "sign": self._elbow_sign()}},
            "locked": {},
            "points": {},
        }
        self._put_shoulder(content, axes)
        self._put_distal(content, axes)
        if self.hand == self.lower:
            content["points"] = {"wrist": {"body": self.hand, "at_m": self._wrist()}}
        return WearerMap.model_validate(content), (self._note(content),)

    def _named(self, freedom: str, beyond: str | None = None) -> Iterator[str]:
        """Yield the coordinates of this side that are named like a freedom, of bodies that `beyond` carries."""
        for body, one in self.document.coordinates():
            name = _without_side(one.name, self.side)
            is_named = name is not None and re.fullmatch(NAMES[freedom], name) is not None
            is_there = beyond is None or self.document.carries(beyond, body)
            if is_named and is_there and one.name not in self.document.couplings:
                yield one.name

    def _body_of(self, coordinate: str) -> str:
        return next(body for body, one in self.document.coordinates() if one.name == coordinate)

    def _coordinate(self, name: str) -> OsimCoordinate:
        return self.kinematics.coordinates[name]

    def _shoulder(self) -> tuple[str, ...]:
        """Coordinates that turn the upper arm about the joint above it, nearest to the trunk first."""
        found: list[str] = []
        centre = None
        for body in reversed(self.document.path_to(self.upper)):
            joint = self.document.joints[body]
            free = [
                axis.coordinate
                for axis in joint.axes
                if axis.coordinate and not axis.is_slide and axis.coordinate not in self.document.couplings
                and not self._coordinate(axis.coordinate).is_locked
            ]  # fmt: skip
            if not free:
                continue
            here = self.kinematics.centre(body)
            centre = here if centre is None else centre
            if float(np.linalg.norm(here - centre)) > CENTRE_M or len(found) + len(free) > 3:
                break
            found = [*dict.fromkeys(free), *found]
        if not found:
            raise ModelError(
                f"{self.document.path}: no joint between the ground and '{self.upper}' turns the upper arm. Unlock the "
                "shoulder, or give a map with --wearer-map."
            )
        return tuple(found)

    def _hand(self) -> str:
        """Body beyond the wrist, or the forearm if the model has none."""
        moved = [self._body_of(name) for freedom, name in self.distal.items() if freedom in FREEDOMS[5:]]
        if moved:
            return max(moved, key=lambda body: len(self.document.path_to(body)))
        named = [
            body for body in self.document.joints
            if "hand" in body.lower() and body != self.lower and self.document.carries(self.lower, body)
        ]  # fmt: skip
        return named[0] if named else self.lower

    def _forearm(self) -> str:
        roll = self.distal.get("forearm_roll")
        return self._body_of(roll) if roll and "forearm_roll" in self.moved else self.lower

    def _lines(self) -> tuple[Vector, Vector]:
        """Upper arm and axis of the elbow, at the present angles [m, -]."""
        elbow = self.kinematics.centre(self.lower, self.roots) - self._shoulder_centre()
        return elbow, self.kinematics.axis(self.elbow, self.roots)

    def _shoulder_centre(self) -> Vector:
        return self.kinematics.centre(self._body_of(self.shoulder[-1]), self.roots)

    def _up(self) -> Vector:
        gravity = self.document.gravity
        return _nearest(-gravity) if gravity.any() else np.array([0.0, 1.0, 0.0])

    def _hang(self) -> None:
        """Turn the shoulder until the upper arm hangs, if it does not do so at zero."""
        up = self._up()

        def tilt(angles: Float[np.ndarray, " hinge"]) -> Float[np.ndarray, " residual"]:
            self.roots |= {name: float(angle) for name, angle in zip(self.shoulder, angles, strict=True)}
            line, _ = self._lines()
            return np.concatenate([line / np.linalg.norm(line) + up, 1e-3 * (angles - start)])

        start = np.zeros(len(self.shoulder))
        line, _ = self._lines()
        length = float(np.linalg.norm(line))
        if length > 0.0 and np.arccos(np.clip(-line @ up / length, -1.0, 1.0)) > HANGS:
            from scipy.optimize import least_squares  # imported here: the import takes 0.1 s

            start = np.array([self._coordinate(name).default for name in self.shoulder])
            tilt(least_squares(tilt, start).x)

    def _axes(self) -> tuple[Vector, Vector, Vector]:
        """Directions forward, left and up as signed axes of the model's world."""
        up, (_, axis) = self._up(), self._lines()
        level = axis - (axis @ up) * up
        if np.linalg.norm(level) < LEVEL_LEAST:
            raise ModelError(
                f"{self.document.path}: the elbow '{self.elbow}' turns about a vertical axis while the arm hangs, so "
                "the directions of the model are unknown. Give a map with --wearer-map."
            )
        left = _nearest(-self._elbow_sign() * level)
        return np.cross(left, up), left, up

    def _elbow_sign(self) -> int:
        one = self._coordinate(self.elbow)
        return 1 if one.low + one.high >= 0.0 else -1

    def _put_shoulder(self, content: dict, axes: tuple[Vector, Vector, Vector]) -> None:
        signs = self._signs(self.shoulder, FREEDOMS[:3], axes) if len(self.shoulder) == 3 else {}
        zeros = {name: float(np.rad2deg(self.roots[name])) for name in self.shoulder}
        if len(signs) < 3:
            content["shoulder"] = {"joints": list(self.shoulder), "zero_deg": list(zeros.values())}
            return
        content["freedoms"] |= {
            freedom: {"joint": name, "sign": signs[freedom], "zero_deg": zeros[name]}
            for freedom, name in zip(FREEDOMS[:3], self.shoulder, strict=True)
        }

    def _put_distal(self, content: dict, axes: tuple[Vector, Vector, Vector]) -> None:
        """Add forearm and wrist: freedoms if the machine moves them, else locked with the palm facing the body."""
        for freedom, name in self.distal.items():
            one, zero = self._coordinate(name), 0.0
            if freedom == "forearm_roll" and np.rad2deg(one.low) > NEUTRAL_BELOW_DEG:
                zero = 90.0
            self.roots[name] = float(np.deg2rad(zero))
            if freedom in self.moved:
                sign = self._signs((name,), (freedom,), axes, np.pi / 2.0)[freedom]
                content["freedoms"][freedom] = {"joint": name, "sign": sign, "zero_deg": zero}
            else:
                content["locked"][name] = zero

    def _signs(
        self,
        names: tuple[str, ...],
        freedoms: tuple[str, ...],
        axes: tuple[Vector, Vector, Vector],
        allowed: float = ALONG,
    ) -> Mapping[str, int]:
        """Signs of the coordinates that turn about the axes of these freedoms within `allowed` [rad]."""
        signs = {}
        for name, freedom in zip(names, freedoms, strict=True):
            along = float(self.kinematics.axis(name, self.roots) @ np.array(axes).T @ axis_of(freedom, self.side))
            if np.arccos(np.clip(abs(along), 0.0, 1.0)) <= allowed:
                signs[freedom] = 1 if along >= 0.0 else -1
        return signs

    def _wrist(self) -> list[float]:
        """End of a forearm of mean length, on the line from the elbow through the body's centre of mass [m]."""
        body, person = self.document.bodies[self.lower], PERSON
        begin = self.document.joints[self.lower].T_child_M[:3, 3]
        along = body.com - begin
        length = TABLE["male"]["forearm"].length * person["height_m"] / SAMPLE["male"].height
        return [float(x) for x in begin + length * along / max(float(np.linalg.norm(along)), 1e-9)]

    def _person(self) -> dict[str, object]:
        mass = sum(body.mass for body in self.document.bodies.values())
        is_whole = PERSON_MASS_KG[0] <= mass <= PERSON_MASS_KG[1]
        return {**PERSON, "mass_kg": mass if is_whole else PERSON["mass_kg"]}

    def _note(self, content: dict) -> str:
        parts = [f"shoulder = {', '.join(self.shoulder)}"] if "shoulder" in content else []
        mapped = content["freedoms"]
        parts += [f"{freedom} = {mapped[freedom]['joint']}" for freedom in FREEDOMS if freedom in mapped]
        parts += [f"{name} locked at {angle:g}°" for name, angle in content["locked"].items()]
        person = content["body"]
        wrist = " The wrist is assumed, too." if content["points"] else ""
        return (
            f"The names of the file stand for a map: {', '.join(parts)}. Assumed person: {person['sex']}, "
            f"{person['height_m']:g} m, {person['mass_kg']:.3g} kg.{wrist} Give a map to state them."
        )


def _without_side(name: str, side: ArmSide) -> str | None:
    """Return a name in lower case without its side; None if it is of the other side."""
    parts = name.lower().replace("-", "_").split("_")
    letters = {"right": ("r", "right"), "left": ("l", "left")}
    other = letters["left" if side == "right" else "right"]
    if parts[0] in other or parts[-1] in other:
        return None
    return "_".join(part for k, part in enumerate(parts) if k not in (0, len(parts) - 1) or part not in letters[side])


def _nearest(direction: Vector) -> Vector:
    """Signed axis that is nearest to a direction."""
    k = int(np.argmax(np.abs(direction)))
    return np.sign(direction[k]) * np.eye(3)[k]


def _direction(axis: Vector) -> str:
    k = int(np.argmax(np.abs(axis)))
    return f"{'-' if axis[k] < 0.0 else ''}{'xyz'[k]}"

"""Settings of a `rig.toml`, checked on load: cuffs, drives, adjustments, known weights, motions."""

from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveFloat, model_validator

from exograv.options import Side

ArmSide = Literal["right", "left"]
Place = Literal["shoulder", "elbow", "wrist"]
"""Place of a machine's joint along the arm; forearm roll belongs to the wrist."""
Segment = Literal["upper_arm", "forearm", "hand"]
ArmKind = Literal["shoulder_elbow", "forearm", "wrist_flexion", "whole"]
"""Kind of arm by the joints that a machine moves, from the shoulder outwards; the other joints stay straight."""
FREEDOMS_OF_ARM: dict[ArmKind, int] = {"shoulder_elbow": 4, "forearm": 5, "wrist_flexion": 6, "whole": 7}
"""Freedoms of one arm by the kind of arm a machine moves (`model.arm`)."""
HAND_APART: frozenset[ArmKind] = frozenset({"wrist_flexion", "whole"})
"""Kinds of arm whose hand is a separate body, because their wrist moves."""
Degrees = Annotated[list[float], Field(min_length=1)]


class Settings(BaseModel):
    """Base of all settings: immutable, unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Urdf(Settings):
    """URDF files, one per side, relative to the folder; a machine for both arms has one file for both."""

    right: str | None = None
    left: str | None = None
    both: str | None = None

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_side(cls, data: Any) -> Any:
        if isinstance(data, dict) and "side" in data:
            raise ValueError(f"side is {data['side']!r}; it must be 'right', 'left' or 'both', beside file")
        return data

    @property
    def sides(self) -> tuple[Side, ...]:
        """Sides that have a file."""
        sides: tuple[Side, ...] = ("right", "left", "both")
        return tuple(side for side in sides if getattr(self, side) is not None)


class WearerSettings(Settings):
    """Nominal position of the wearer's shoulder, and the arm joints that the machine moves."""

    shoulder_centre: str | dict[ArmSide, str]
    """Frame of the shoulder centre; one frame per side in a machine for both arms."""

    arm: ArmKind = "shoulder_elbow"
    """Joints that the machine moves: shoulder and elbow; also forearm roll; also wrist flexion; or all, with wrist
    deviation. If the wrist does not move, the hand is part of the forearm."""


class Adjustment(Settings):
    """Adjustable length of the machine, set to the wearer's measured segment.

    The origin of `joint` moves along an axis of its parent's frame. Its coordinate gets the measured length and keeps
    the sign that it has in the URDF.
    """

    joint: str
    segment: Literal["upper_arm", "forearm"]
    nominal_m: PositiveFloat
    """Length in the URDF."""
    min_m: PositiveFloat
    max_m: PositiveFloat
    """Adjustable range of the length [m]. `range_m = [0.2, 0.37]` is a short form of `min_m` and `max_m`."""
    axis: Literal["x", "y", "z"] = "z"
    """Axis of the parent's frame."""

    @model_validator(mode="before")
    @classmethod
    def _range_as_ends(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "range_m" not in data:
            return data
        match data["range_m"]:
            case [int() | float() as low, int() | float() as high] if "min_m" not in data and "max_m" not in data:
                rest = {key: value for key, value in data.items() if key != "range_m"}
                return rest | {"min_m": low, "max_m": high}
            case other:
                raise ValueError(f"range_m is {other!r}; it must be [shortest, longest], without min_m and max_m")


CUFF_AXES = ("x", "y", "z", "about_x", "about_y", "about_z")


class Cuff(Settings):
    """Soft connection between a frame of the exoskeleton, z along the limb, and a segment of the arm.

    A cuff with stiffness in all six directions holds like a weld. A stiffness of 0 leaves a direction free: without
    rotational stiffness the cuff is a point contact, without stiffness along the limb a sleeve. `free` names single
    axes, such as that of a hinge or slide.
    """

    name: str
    exo_frame: str
    """Link of the URDF at the cuff, with z along the limb."""
    segment: Segment
    side: ArmSide | None = None
    """Side of the arm, in a machine for both arms."""
    along_N_per_mm: NonNegativeFloat
    """Stiffness along the limb."""
    across_N_per_mm: NonNegativeFloat
    """Stiffness across the limb, in both directions."""
    about_limb_Nm_per_deg: NonNegativeFloat
    """Stiffness about the limb."""
    about_others_Nm_per_deg: NonNegativeFloat
    """Stiffness about the two axes across the limb."""
    free: list[Literal["x", "y", "z", "about_x", "about_y", "about_z"]] = []
    """Free axes of the cuff's frame, regardless of its stiffness; z is along the limb."""

    @property
    def stiffness(self) -> Float[np.ndarray, " 6"]:
        """Diagonal stiffness in the cuff's frame, z along the limb: x, y, z [N/m], then about x, y, z [N·m/rad]."""
        across, along = 1000.0 * self.across_N_per_mm, 1000.0 * self.along_N_per_mm
        about_others, about_limb = np.rad2deg([self.about_others_Nm_per_deg, self.about_limb_Nm_per_deg])
        stiffness = np.array([across, across, along, about_others, about_others, about_limb])
        stiffness[[CUFF_AXES.index(axis) for axis in self.free]] = 0.0
        return stiffness


class Donning(Settings):
    """Posture in which the cuffs are fastened."""

    posture_deg: Degrees
    """Posture of the machine's joints [°]."""

    arm_posture_deg: Degrees | None = None
    """Posture of the arm's freedoms (`model.arm`) [°]; the machine's posture if its joints are the arm's, in order."""


MOTOR = (
    "torque_constant_Nm_per_A", "gear_ratio", "efficiency", "torque_max_Nm", "rotor_inertia_kgm2",
    "weak_kp_Nm_per_rad", "weak_kd_Nms_per_rad",
)  # fmt: skip
"""Fields of an actuator that a joint without motor does not have."""


class Actuator(Settings):
    """Drive by its data sheet; the real gain is calibrated (`dynamics.actuator`).

    A joint with an encoder and no motor is "passive"; it has none of the fields of `MOTOR`.
    """

    joint: str
    place: Place
    """Place of the joint along the arm."""
    drive: Literal["harmonic", "quasi_direct", "passive"]
    torque_constant_Nm_per_A: PositiveFloat | None = None
    """Motor torque per current, before the gear [N·m/A]."""
    gear_ratio: PositiveFloat | None = None
    efficiency: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """Share of the motor's torque that the gear transmits [-]."""
    torque_max_Nm: PositiveFloat | None = None
    """Largest torque at the joint; the guard allows no more."""
    rotor_inertia_kgm2: Annotated[float, Field(ge=0.0)] | None = None
    """Inertia of the rotor, reflected through the gear to the joint [kg·m²]."""
    weak_kp_Nm_per_rad: PositiveFloat | None = None
    weak_kd_Nms_per_rad: PositiveFloat | None = None
    """Gains of the weak PD that follows a reference while the machine drives the arm."""
    range_deg: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None
    """Lower and upper limit of the joint, if the URDF gives none."""
    speed_max_deg_s: PositiveFloat | None = None
    """Largest speed of the joint, if the URDF gives none."""

    @model_validator(mode="after")
    def _range_in_order(self) -> "Actuator":
        if self.range_deg is not None and self.range_deg[0] >= self.range_deg[1]:
            raise ValueError(f"range_deg of {self.joint} is {self.range_deg}; the first must be below the second")
        return self

    @model_validator(mode="after")
    def _motor_or_none(self) -> "Actuator":
        missing = [field for field in MOTOR if getattr(self, field) is None]
        if self.drive == "passive" and len(missing) < len(MOTOR):
            raise ValueError(f"{self.joint} is passive: it has no motor, and none of {', '.join(MOTOR)}")
        if self.drive != "passive" and missing:
            raise ValueError(f"{self.joint} has a motor; it needs {', '.join(missing)}")
        return self

    @property
    def nominal_gain(self) -> float:
        """Joint torque per motor current from the data sheet [N·m/A]; zero without a motor."""
        if self.torque_constant_Nm_per_A is None or self.gear_ratio is None or self.efficiency is None:
            return 0.0
        return self.torque_constant_Nm_per_A * self.gear_ratio * self.efficiency


class TaskWorkspace(Settings):
    """Box of postures in which the arm must be weightless."""

    lower_deg: Degrees
    upper_deg: Degrees
    """Limits of each joint."""


class JointSweep(Settings):
    """Sweep of one joint back and forth, others at rest, without weight and with each known weight at the mount."""

    joint: str
    from_deg: float
    to_deg: float
    posture_deg: Degrees
    """Posture of all joints [°]; the entry of the moving joint is not used."""
    mount: str | None = None
    """Mount of the weights in this sweep; if absent, the calibration's main mount."""


class CalibrationSettings(Settings):
    """Known weights, their mounts and the sweeps of the calibration of the empty machine."""

    mount: str
    """Frame where known weights hang, unless a sweep names another."""
    weights_kg: Annotated[list[PositiveFloat], Field(min_length=2)]
    sweeps: Annotated[list[JointSweep], Field(min_length=1)]

    @property
    def mounts(self) -> tuple[str, ...]:
        """Frames where weights hang, the calibration's main mount first."""
        return tuple(dict.fromkeys([self.mount, *(sweep.mount for sweep in self.sweeps if sweep.mount is not None)]))


class Excitation(Settings):
    """Excitation motion that identifies the arm: harmonics of one period around a posture, one row per harmonic."""

    period_s: PositiveFloat
    centre_deg: Degrees
    """Posture around which the machine moves."""
    source: Literal["own", "proposed", "designed"] = "own"
    """Origin: the user, `exograv rig new` (which does not know the machine's task), or `exograv rig motion`.

    A motion of `exograv rig new` is fitted into each `range_deg` when the file is read.
    """
    sine_deg: Annotated[list[Degrees], Field(min_length=1)]
    cosine_deg: Annotated[list[Degrees], Field(min_length=1)]
    """Amplitudes of the cosines, a row per harmonic with an entry per joint."""


def written_out(data: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a `rig.toml` without its short forms.

    [drives] gives its values to the joints that do not override them, `urdf.file` with `urdf.side` is the file of that
    side, a sweep without ends takes the middle of the joint's `range_deg`, and a proposed excitation is fitted into it.

    Raises:
        ValueError: [drives] has a key that belongs to one joint or to none.
    """
    urdf = data.get("urdf")
    if isinstance(urdf, dict) and set(urdf) == {"file", "side"} and urdf["side"] in ("right", "left", "both"):
        data = data | {"urdf": {urdf["side"]: urdf["file"]}}
    return _with_fitted_excitation(_with_sweep_ends(_with_drives(data)))


def _with_sweep_ends(data: dict[str, Any]) -> dict[str, Any]:
    plan, actuators = data.get("calibration"), data.get("actuators")
    if not isinstance(plan, dict) or not isinstance(plan.get("sweeps"), list) or not isinstance(actuators, list):
        return data
    ranges = {one.get("joint"): one.get("range_deg") for one in actuators if isinstance(one, dict)}
    sweeps = []
    for sweep in plan["sweeps"]:
        match ranges.get(sweep.get("joint")) if isinstance(sweep, dict) else None:
            case [int() | float() as lower, int() | float() as upper] if lower < upper:
                low, high = sweep_ends(lower, upper)
                sweeps.append({"from_deg": low, "to_deg": high} | sweep)
            case str(asked):  # The question for the range is the question for the ends.
                sweeps.append({"from_deg": asked, "to_deg": asked} | sweep)
            case _:
                sweeps.append(sweep)
    return data | {"calibration": plan | {"sweeps": sweeps}}


EXCITATION_SHARE = 0.25
"""Largest deviation of a proposed excitation from its centre, as a share of the joint's range."""


def _with_fitted_excitation(data: dict[str, Any]) -> dict[str, Any]:
    """Fit a proposed excitation into each `range_deg`, which is answered after the proposal was written."""
    plan, actuators = data.get("excitation"), data.get("actuators")
    if not isinstance(plan, dict) or plan.get("source") != "proposed" or not isinstance(actuators, list):
        return data
    keys = ("centre_deg", "sine_deg", "cosine_deg")
    try:
        centre, sine, cosine = (np.array(plan.get(key), float) for key in keys)
    except (TypeError, ValueError):
        return data
    if not all(np.isfinite(part).all() for part in (centre, sine, cosine)):
        return data
    if sine.ndim != 2 or sine.shape != cosine.shape or not (centre.shape == sine.shape[1:] == (len(actuators),)):
        return data
    for i, one in enumerate(actuators):
        match one.get("range_deg") if isinstance(one, dict) else None:
            case [int() | float() as lower, int() | float() as upper] if lower < upper:
                # The deviation from the centre is never larger than the sum of the harmonics' amplitudes.
                size, most = np.hypot(sine[:, i], cosine[:, i]).sum(), EXCITATION_SHARE * (upper - lower)
                share = min(1.0, most / size) if size else 1.0
                sine[:, i], cosine[:, i] = share * sine[:, i], share * cosine[:, i]
                centre[i] = np.clip(centre[i], lower + share * size, upper - share * size)
            case _:
                pass
    fitted = {key: part.tolist() for key, part in zip(keys, (centre, sine, cosine), strict=True)}
    return data | {"excitation": plan | fitted}


SWEEP_MARGIN, SWEEP_DEG = 0.1, 90.0
"""Limits of a proposed sweep: distance from the joint limits as a share of the range, and largest length [°]."""


def sweep_ends(lower_deg: float, upper_deg: float) -> tuple[float, float]:
    """Return the ends of a proposed sweep between the limits of a joint [°]."""
    middle = 0.5 * (lower_deg + upper_deg)
    reach = min(0.5 * SWEEP_DEG, (0.5 - SWEEP_MARGIN) * (upper_deg - lower_deg))
    return round(middle - reach, 1), round(middle + reach, 1)


def _with_drives(data: dict[str, Any]) -> dict[str, Any]:
    """Return the content with the table [drives] moved into the joints that do not override it.

    Raises:
        ValueError: [drives] has a key that belongs to one joint or to none.
    """
    shared, actuators = data.get("drives"), data.get("actuators")
    if not isinstance(shared, dict) or not isinstance(actuators, list):
        return data
    allowed = ("drive", "speed_max_deg_s", *MOTOR)
    if unknown := [key for key in shared if key not in allowed]:
        raise ValueError(f"drives has the keys {', '.join(unknown)}; allowed: {', '.join(allowed)}")
    of_all = {key: shared[key] for key in ("drive", "speed_max_deg_s") if key in shared}
    joints = []
    for own in actuators:
        is_passive = not isinstance(own, dict) or {**of_all, **own}.get("drive") == "passive"
        joints.append(own if not isinstance(own, dict) else {**(of_all if is_passive else shared), **own})
    return {key: value for key, value in data.items() if key != "drives"} | {"actuators": joints}


class RigSettings(Settings):
    """Content of a `rig.toml`."""

    name: str
    title: str
    urdf: Urdf
    wearer: WearerSettings
    adjustments: list[Adjustment] = []
    cuffs: Annotated[list[Cuff], Field(min_length=1)]
    donning: Donning
    actuators: Annotated[list[Actuator], Field(min_length=1)]
    task_workspace: TaskWorkspace
    calibration: CalibrationSettings | None = None
    """Weights and sweeps of the calibration; absent in a machine without motors."""
    excitation: Excitation | None = None
    """Motion that identifies the arm; absent in a machine without motors."""

    @model_validator(mode="before")
    @classmethod
    def _short_forms(cls, data: Any) -> Any:
        return written_out(data) if isinstance(data, dict) else data

    @model_validator(mode="after")
    def _one_entry_per_actuator(self) -> "RigSettings":
        n = len(self.actuators)
        lists = {
            "donning.posture_deg": self.donning.posture_deg,
            "task_workspace.lower_deg": self.task_workspace.lower_deg,
            "task_workspace.upper_deg": self.task_workspace.upper_deg,
            **{f"calibration.sweeps of {sweep.joint}": sweep.posture_deg for sweep in self.sweeps},
        }
        if self.excitation is not None:
            lists["excitation.centre_deg"] = self.excitation.centre_deg
            lists |= {f"excitation.sine_deg[{k}]": row for k, row in enumerate(self.excitation.sine_deg)}
            lists |= {f"excitation.cosine_deg[{k}]": row for k, row in enumerate(self.excitation.cosine_deg)}
        for name, values in lists.items():
            if len(values) != n:
                raise ValueError(f"{name} has {len(values)} entries; it needs one for each of the {n} actuators")
        return self

    @model_validator(mode="after")
    def _ranges_and_names_agree(self) -> "RigSettings":
        joints = [actuator.joint for actuator in self.actuators]
        for kind, names in (("actuators", joints), ("cuffs", [cuff.name for cuff in self.cuffs])):
            if len(set(names)) < len(names):
                raise ValueError(f"{kind} {', '.join(names)}: two share a name")
        for place in (*self.sweeps, *self.adjustments):
            if place.joint not in joints:
                raise ValueError(f"no actuator moves '{place.joint}'; actuators are at {', '.join(joints)}")
        for low, high in zip(self.task_workspace.lower_deg, self.task_workspace.upper_deg, strict=True):
            if low >= high:
                raise ValueError(f"task_workspace.lower_deg {low} must be below upper_deg {high}")
        for a in self.adjustments:
            if not a.min_m <= a.nominal_m <= a.max_m:
                raise ValueError(f"adjustment of {a.joint}: {a.nominal_m} m must lie between {a.min_m} and {a.max_m} m")
        self._refuse_wrong_sides()
        self._refuse_motors_without_plan()
        return self

    @property
    def sweeps(self) -> list[JointSweep]:
        """Sweeps of the calibration; empty in a machine without motors."""
        return [] if self.calibration is None else self.calibration.sweeps

    def _refuse_motors_without_plan(self) -> None:
        """Raise ValueError if a machine with motors has no calibration or excitation motion."""
        motors = [actuator.joint for actuator in self.actuators if actuator.drive != "passive"]
        missing = [name for name in ("calibration", "excitation") if getattr(self, name) is None]
        if motors and missing:
            raise ValueError(f"motors at {', '.join(motors)}: {' and '.join(missing)} must say how they move")
        plan = self.excitation
        if plan is not None and len(plan.sine_deg) != len(plan.cosine_deg):
            raise ValueError("excitation.sine_deg and cosine_deg need as many rows as each other, one a harmonic")

    def _refuse_wrong_sides(self) -> None:
        """Raise ValueError if arms, cuffs and postures do not agree."""
        if not self.urdf.sides:
            raise ValueError("urdf names no file; give right, left or both")
        for_both = self.urdf.both is not None
        if for_both and len(self.urdf.sides) > 1:
            raise ValueError("urdf.both is one machine for both arms; then urdf.right and urdf.left must go")
        if for_both != isinstance(self.wearer.shoulder_centre, dict):
            raise ValueError(
                "wearer.shoulder_centre must name a frame for right and one for left if, and only if, "
                "urdf.both is given"
            )
        for cuff in self.cuffs:
            if for_both != (cuff.side is not None):
                raise ValueError(f"cuff {cuff.name}: a side is needed if, and only if, urdf.both is given")
            if cuff.segment == "hand" and self.wearer.arm not in HAND_APART:
                raise ValueError(
                    f"cuff {cuff.name} holds the hand; wearer.arm must then be one that moves the wrist: "
                    "'wrist_flexion' or 'whole'"
                )
        freedoms = FREEDOMS_OF_ARM[self.wearer.arm] * (2 if for_both else 1)
        posture = self.donning.arm_posture_deg or self.donning.posture_deg
        if len(posture) != freedoms:
            name = "arm_posture_deg" if self.donning.arm_posture_deg else "posture_deg, which stands for the arm's too,"
            raise ValueError(f"donning.{name} has {len(posture)} angles; the arm has {freedoms} freedoms")

"""Third party's arm as the twin's truth: a model file and a map become a skeleton and the person it belongs to."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exograv.errors import ConfigError, ModelError
from exograv.model.description import RigDescription
from exograv.model.limb import FREEDOMS
from exograv.model.rig_settings import FREEDOMS_OF_ARM
from exograv.rig.twin.wearer.segments import Body
from exograv.rig.twin.wearer.skeleton import Skeleton, axis_of

from .model_bones import build_skeleton
from .model_joints import hanging
from .opensim_naming import map_by_names
from .wearer_file import compile_wearer, open_wearer_file
from .wearer_map import WearerMap, read_wearer_map

ASKEW_MAX = np.deg2rad(50.0)
"""Largest angle between the axis of a joint and that of its freedom [rad].

A joint farther off belongs to another freedom. Real elbows are 13° off.
"""

LENGTHS_M = (0.1, 0.5)
"""Allowed length of an upper arm and a forearm."""

MASS_KG = (0.5, 12.0)
"""Allowed mass of an arm: from a child's to twice that of a man of 100 kg."""

MAP_MISSING = (
    "{missing} is missing: a wearer's model needs its map, and a map needs its model; only the names of an OpenSim "
    "model (.osim) can stand for a map (docs/howto/wearer_models.md)."
)


@dataclass(frozen=True)
class WearerModel:
    """Arm and person that are the twin's truth."""

    title: str
    skeleton: Skeleton
    body: Body
    notes: tuple[str, ...]
    """Notes about parts of the model that are not used, or are used in another way."""

    sha256: str
    """Hash of model and map."""


def read_wearer_model(model: Path, told: Path | None, description: RigDescription) -> WearerModel:
    """Read the arm of a model file for a machine; without a map, the names of an OpenSim model say which part is which.

    Raises:
        ConfigError: A file cannot be read, or the map cannot be used.
        ModelError: Model and map do not agree, or the machine cannot move this arm.
    """
    file, notes = open_wearer_file(model), ()
    if told is not None:
        spoken = read_wearer_map(told)
    elif file.opensim is not None:
        spoken, notes = map_by_names(file.opensim, description)
    else:
        raise ConfigError(MAP_MISSING.format(missing="--wearer-map"))
    _refuse_other_machine(spoken, description)
    compiled, left_out = compile_wearer(file, spoken)
    stand = hanging(compiled, spoken)
    skeleton = build_skeleton(compiled, spoken, stand, description.settings.wearer.arm)
    _refuse_impossible(skeleton)
    person = spoken.body
    notes = (*notes, *left_out, *stand.notes)
    if not skeleton.follows_elevation:
        notes = (*notes, "A girdle of bones moves the shoulder: the twin's own shift of its centre is off.")
    digest = hashlib.sha256(model.read_bytes() + (told.read_bytes() if told else b"")).hexdigest()
    return WearerModel(spoken.title, skeleton, Body(person.sex, person.height_m, person.mass_kg), notes, digest)


def _refuse_other_machine(told: WearerMap, description: RigDescription) -> None:
    if description.arm_sides != (told.side,):
        held = " and ".join(description.arm_sides)
        raise ConfigError(
            f"The wearer's model is a {told.side} arm; {description.name} holds the {held} one. Choose another with "
            "--side or --rig, or mirror the model."
        )
    moved = FREEDOMS[: FREEDOMS_OF_ARM[description.settings.wearer.arm]]
    named = {*told.freedoms, *(FREEDOMS[:3] if told.shoulder else ())}
    for freedom in FREEDOMS:
        if freedom in moved and freedom not in named:
            raise ConfigError(
                f"{description.name} moves {', '.join(moved)}; the map has no joint for {freedom}. Add "
                f"[freedoms.{freedom}], or choose a machine for shoulder and elbow alone."
            )
        if freedom not in moved and freedom in named:
            raise ConfigError(
                f"{description.name} does not move {freedom}: nothing would hold it. Lock the joint "
                f"'{told.freedoms[freedom].joint}' at an angle under [locked], or choose another machine."
            )


def _refuse_impossible(skeleton: Skeleton) -> None:
    mass = sum(bone.mass for bone in skeleton.bones if bone.segment in skeleton.centres)
    if not MASS_KG[0] <= mass <= MASS_KG[1]:
        raise ModelError(
            f"The model's arm weighs {mass:.3g} kg; allowed: {MASS_KG[0]} to {MASS_KG[1]} kg. Check its units, or give "
            "mass_scale in the map."
        )
    for name in ("upper_arm", "forearm"):
        if not LENGTHS_M[0] <= skeleton.lengths[name] <= LENGTHS_M[1]:
            raise ModelError(
                f"The model's {name} is {skeleton.lengths[name]:.3g} m long; allowed: {LENGTHS_M[0]} to {LENGTHS_M[1]} "
                "m. Check its units, and the joints of the map."
            )
    _refuse_askew(skeleton)


def _refuse_askew(skeleton: Skeleton) -> None:
    for bone in skeleton.bones:
        for joint in bone.joints:
            if joint.name not in FREEDOMS:
                continue
            usual = axis_of(joint.name, skeleton.side)
            askew = float(np.arccos(np.clip(joint.axis @ usual, -1.0, 1.0)))
            if askew > ASKEW_MAX:
                axis = " ".join(f"{x:.2f}" for x in joint.axis)
                hint = (
                    "Turn its sign." if askew > np.pi - ASKEW_MAX else "Check joint, zero_deg and the axes of the map."
                )
                raise ModelError(
                    f"freedoms.{joint.name}: while the arm hangs, the joint of '{bone.name}' turns about ({axis}) in "
                    f"our axes, {np.rad2deg(askew):.0f}° from ({usual[0]:g} {usual[1]:g} {usual[2]:g}). {hint}"
                )

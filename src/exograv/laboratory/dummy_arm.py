"""Simulated dummy arm: two rigid links in the cuffs of the twin, in the place of a person."""

from dataclasses import replace

import numpy as np

from exograv.procedures.acceptance.dummy import LIMB, Dummy, LimbSegment
from exograv.rig.twin.disturbances.streams import stream
from exograv.rig.twin.wearer.segments import Body, Segment
from exograv.rig.twin.wearer.skeleton import drawn_skeleton
from exograv.rig.twin.wearer.wearer import PassiveJoints, RestlessArm, Wearer, WearerArm

from .virtual_laboratory import VirtualLaboratory

OWNER = "dummy"

HAND_KG = 1e-6
"""Mass of a hand that the dummy does not have [kg]; the physics engine does not accept zero."""


def with_dummy(laboratory: VirtualLaboratory, dummy: Dummy, seed: int) -> VirtualLaboratory:
    """Put a dummy into the machine of a laboratory, in the straps of its wearer.

    Masses, places and the shoulder's place are drawn within the errors that the file states.

    Raises:
        ConfigError: The machine cannot hold the dummy.
    """
    lengths = dict(dummy.form_for(laboratory.description).lengths)
    person = laboratory.wearer
    segments = {name: _segment(dummy, name, seed) for name in LIMB}
    zero = np.zeros(3)
    segments["hand"] = Segment(dummy.settings.lengths_m.hand, HAND_KG, zero, 1e-3 * HAND_KG * np.eye(3))
    form = dummy.settings.form
    wearer = Wearer(
        body=Body(form.sex, form.height_m, form.mass_kg),
        arms=tuple(_arm(dummy, segments, arm, seed, number) for number, arm in enumerate(person.arms)),
        lengths_given={**dummy.settings.lengths_m.model_dump(), **lengths},
        glenohumeral_share=0.0,
        cuffs=person.cuffs,
    )
    return replace(laboratory, wearer=wearer, wearer_model=None)


def _segment(dummy: Dummy, name: LimbSegment, seed: int) -> Segment:
    phi = dummy.drawn_phi(name, stream(seed, OWNER, name))
    mass, com = float(phi[0]), phi[1:4] / phi[0]
    xx, xy, yy, xz, yz, zz = phi[4:]
    about_joint = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    inertia = about_joint - mass * (com @ com * np.eye(3) - np.outer(com, com))
    return Segment(getattr(dummy.settings.lengths_m, name), mass, com, inertia)


def _arm(dummy: Dummy, segments: dict[str, Segment], person: WearerArm, seed: int, number: int) -> WearerArm:
    skeleton = drawn_skeleton(segments, person.side, person.skeleton.kind)
    n = len(skeleton.freedoms)
    nothing, within = np.zeros(n), 1e-3 * dummy.settings.within.shoulder_mm
    return WearerArm(
        skeleton=skeleton,
        donning_offset=within * stream(seed + number, OWNER, "shoulder").uniform(-1.0, 1.0, 3),
        passive=PassiveJoints(
            stiffness=nothing,
            neutral=nothing,
            damping=np.full(n, dummy.settings.bearings.damping_Nms_per_rad),
            range=np.tile([-np.pi, np.pi], (n, 1)),
            stop=nothing,
            hysteresis=0.0,
        ),
        unrest=RestlessArm(nothing, np.ones(n), 0.0, nothing),
    )

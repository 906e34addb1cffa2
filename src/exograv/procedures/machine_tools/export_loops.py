"""Data that no URDF holds about a machine with an arm: cuffs, shoulder offset, elasticity and gravity."""

from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.files import toml_text
from exograv.model.loops import ELEVATION_ROUNDING, NEAR_HANGING, PATH_SHAPES
from exograv.model.mjcf_writer import ArmSprings
from exograv.model.personal import Personal
from exograv.storage.participant_schema import StoredParticipant

HEAD = """\
# The closed loops between exo.urdf and arm.urdf, written by `exograv rig export` (docs/howto/participants.md).
# Lengths in m,
# angles in rad, stiffness in N/m and N·m/rad. At rest the arm lies where its weight, its joints' elasticity and the
# cuffs' energy balance; energy of a cuff = 1/2 sum(stiffness * e^2), e = displacement and sine of rotation from
# exo_frame to arm_frame, in exo_frame.
#
# The shoulder centre moves along the joints arm_shift, arm_shift_forward and arm_shift_outward, in this order:
# slope * s + bend * 4 * x * (1 - x) + near_hanging * exp((k - 1) / near_hanging_rad^2)
# + ahead * sin(flexion) * cos(abduction) + aside * sin(abduction), with
# s = theta * (1 + c * theta) / (1 + c * pi / 2), c = 1.83 / 22.0, x = theta / (pi / 2),
# theta = atan2(sqrt(1 - k^2 + rounding^2), k), k = cos(flexion) * cos(abduction). In exo_and_arm.xml these joints
# are fixed at their values in the middle of the task workspace.
"""


def loops_text(
    whole: StoredParticipant,
    person: Personal,
    springs: ArmSprings,
    gravity: Float[np.ndarray, " 3"],
    links: str,
) -> str:
    """Return the loops of a machine and an arm as TOML."""
    source = {
        "code": whole.person.code,
        "participant_sha256": whole.content_sha256,
        "rig": whole.machine.rig,
        "rig_sha256": whole.machine.rig_sha256,
        "links": links,
        "gravity": gravity,
    }
    arms = (
        {
            "side": side,
            "base": base,
            "offset_from_machine": person.offsets[side],
            "shift_rounding": ELEVATION_ROUNDING,
            "shift_near_hanging_rad": NEAR_HANGING,
            "shift_slope_m_per_rad": person.paths[side]["slope"],
            **{f"shift_{shape}_m": person.paths[side][shape] for shape in PATH_SHAPES},
        }
        for side, base in person.bases.items()
    )
    cuffs = (
        {name: getattr(cuff, name) for name in ("name", "exo_frame", "arm_frame", "stiffness")} for cuff in person.cuffs
    )
    joints = (
        {"joint": joint, "stiffness": stiffness, "neutral": springs.neutral[joint], "damping": springs.damping[joint]}
        for joint, stiffness in springs.stiffness.items()
    )
    tables = {"source": source, "arm": list(arms), "cuff": list(cuffs), "arm_joint": list(joints)}
    return toml_text(_plain(tables), HEAD + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [_plain(inner) for inner in value]
    return value.tolist() if isinstance(value, np.ndarray) else value

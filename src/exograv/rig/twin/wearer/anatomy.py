"""Anatomy that healthy adults' arms have in common: neutral angles, ranges and end stops of their freedoms."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class FreedomAnatomy:
    """Anatomy of one freedom of an arm, as named in `model.limb.FREEDOMS`."""

    place: Literal["shoulder", "elbow", "wrist"]
    """Column of the wearer's disturbances."""

    neutral_deg: float
    """Angle about which the relaxed joint is elastic; its SD between people is 10°."""

    range_deg: tuple[float, float]
    stop_Nm: float
    """Torque of the end stop at the end of the range [N·m]."""

    burst_share: float
    """Share of a burst's torque (`muscles.BURST_TORQUE`) at this freedom [-]."""


# Neutral angles: 20° forward, 30° of elevation, elbow 107° from straight (sign unverified); forearm and wrist straight,
# assumed.
# Ranges: flexion 60° back to 180°, abduction 30° across to 180°, rotation 90° out to 70° in, elbow 0 to 150°, the usual
# textbook figures, unverified; forearm 80° either way, wrist 80° of flexion, 70° of extension, 20° radial, 30° ulnar:
# AAOS, as tabulated in F. A. Davis PT Collection, table A.1, https://fadavispt.mhmedical.com. The angles at which a
# model of the arm clamps its joints are other quantities.
# End stops: 10-20 N·m at the shoulder, unverified; at the wrist 0.5 N·m in 90° of flexion, 1.2 in 90° of extension and
# 0.9 in full ulnar deviation: Delp, Grierson & Buchanan (1996), J Biomech 29:1371, abstract. Bursts at the wrist are a
# fifth of the others, because the greatest voluntary torque of the wrist, some 10 N·m, is a fifth of the shoulder's:
# the same abstract.
ANATOMY: Mapping[str, FreedomAnatomy] = {
    "flexion": FreedomAnatomy("shoulder", 20.0, (-60.0, 180.0), 15.0, 1.0),
    "abduction": FreedomAnatomy("shoulder", 30.0, (-30.0, 180.0), 15.0, 1.0),
    "rotation": FreedomAnatomy("shoulder", 0.0, (-90.0, 70.0), 15.0, 1.0),
    "elbow": FreedomAnatomy("elbow", 107.0, (0.0, 150.0), 15.0, 1.0),
    "forearm_roll": FreedomAnatomy("wrist", 0.0, (-80.0, 80.0), 1.0, 0.2),
    "wrist_flexion": FreedomAnatomy("wrist", 0.0, (-70.0, 80.0), 1.0, 0.2),
    "wrist_deviation": FreedomAnatomy("wrist", 0.0, (-30.0, 20.0), 1.0, 0.2),
}

"""Path of the shoulder's centre in a foreign world: another share, direction, shape and time than the estimator's."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.streams import stream

from .posture import rotation

TURN_MAX = np.deg2rad(40.0)
SECOND_TERM_MAX = 0.4
"""Largest share that the plane of elevation adds or takes. Assumed [-]."""


@dataclass(frozen=True)
class ShoulderPath:
    """Way in which a shoulder's centre moves, where it does not move as at home."""

    share: float
    """Share of the shift with elevation [-]."""

    by_plane: float
    """Further share when the arm points forward, by the forward part of the upper arm's direction [-]."""

    turn: Float[np.ndarray, " 2"]
    """Turn of the path's direction: in the frontal plane, outwards positive, then out of it, forward positive [rad]."""

    lag: float
    """Time constant with which the centre follows the arm [s].

    The girdle's muscles carry the centre, so that a late centre is no passive element: they do work on it.
    """

    def direction(self, usual: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
        """Return the unit direction of the path, from the `usual` one in the frontal plane."""
        return turned(usual, self.turn)

    def directions(self, usual: Float[np.ndarray, " 3"]) -> tuple[Float[np.ndarray, " 3"], ...]:
        """Return the unit directions in which the centre moves, here one."""
        return (self.direction(usual),)


def turned(usual: Float[np.ndarray, " 3"], turn: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 3"]:
    """Return the `usual` direction of a shoulder, turned by the two angles of `ShoulderPath.turn`."""
    forward = np.array([1.0, 0.0, 0.0])
    # The usual direction lies between up and medial; its lateral part tells the side.
    outwards = float(np.sign(usual[1]))
    in_plane = rotation(forward, outwards * turn[0]) @ usual
    return rotation(np.cross(in_plane, forward), turn[1]) @ in_plane


def draw_shoulder_path(seed: int) -> ShoulderPath:
    """Draw the path of both shoulders of a person. The draw does not depend on the level."""
    generator = stream(seed, "wearer", "world shoulder")
    return ShoulderPath(
        share=float(generator.uniform(0.3, 1.2)),
        by_plane=float(generator.uniform(-SECOND_TERM_MAX, SECOND_TERM_MAX)),
        turn=generator.uniform(-TURN_MAX, TURN_MAX, 2),
        lag=float(generator.uniform(0.2, 0.5)),
    )

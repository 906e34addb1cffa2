"""Finding of the drift monitor: size, joint and likely cause, with its text for the operator."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEVELS = 1, 2
"""Levels of a finding in an answer of control: for the operator, and for a descent."""

CAUSES = ONE_JOINT, OTHER_ARM, ALL_JOINTS = (
    "the motor or the encoders of this joint",
    "another person's file, or a weight in the hand",
    "a tilted base, a cuff that has moved, or a wearer who pushes",
)
"""Likely causes, by the joints at which the residual is large."""


@dataclass(frozen=True)
class DriftFinding:
    """Finding of the monitor."""

    joint: int
    residual_Nm: float
    """Mean of measured torque minus torque of the model since the residual became too large [N·m]."""

    stops: bool
    """True if the arm has to come down; False if only a message goes to the operator."""

    cause: str
    """Likely cause, as a clause for the operator."""

    @classmethod
    def of_answer(cls, answer: np.void) -> "DriftFinding | None":
        """Return the finding in an answer of control; None if it has none, or one that cannot be.

        Args:
            answer: Row of `runtime.control_loop.exchange.answer_dtype`.
        """
        level, joint, cause = (int(answer[name]) for name in ("drift", "drift_joint", "drift_cause"))
        if level not in LEVELS or not (0 <= joint < len(answer["tau"]) and 0 <= cause < len(CAUSES)):
            return None
        return cls(joint, float(answer["drift_Nm"]), level == LEVELS[1], CAUSES[cause])

    @property
    def level(self) -> int:
        """Level of the finding in an answer of control: 1 for the operator, 2 for a descent."""
        return LEVELS[self.stops]

    def text(self, joints: Sequence[str]) -> str:
        """Return the sentence for the operator."""
        verb = "The arm comes down" if self.stops else "Watch the arm"
        return (
            f"{verb}: the torque at {joints[self.joint]} differs from the model by {self.residual_Nm:+.1f} N·m and "
            f"more motion does not explain it. Likely cause: {self.cause}."
        )

"""Conditions of a virtual study: the training, its machine, and the share of the arm's weight left on purpose."""

import re
from dataclasses import dataclass
from typing import Literal, cast, get_args

from exograv.errors import ConfigError

Training = Literal["table", "gcm", "gradient", "dam", "ideal", "water", "parabolic"]
"""Trainings. table: machine calibrated, arm from the table. gcm: only the machine is carried. gradient, dam: arm
identified by the paper's gradient descent, or by our method. ideal: true arm and machine. water: in a tank of water,
without machine. parabolic: in flight only."""

Drives = Literal["harmonic", "quasi-direct"]

MOTORLESS: tuple[Training, ...] = ("water", "parabolic")
"""Trainings in which no motor acts."""

FRICTION_MAX = 4.0

_GRAMMAR = re.compile(
    rf"(?P<training>{'|'.join(get_args(Training))})"
    rf"(?:@(?P<drives>{'|'.join(get_args(Drives))}))?"
    r"(?:\+left=(?P<left>\d*\.?\d+))?(?:\+friction=(?P<friction>\d*\.?\d+))?"
)
_ALLOWED = (
    f"Allowed: one of {', '.join(get_args(Training))}; with a machine also @quasi-direct, then +left=0 to 1 (share of "
    f"the arm's weight that is left on purpose), then +friction=0 to {FRICTION_MAX:g} (relative to the machine's own), "
    "such as dam@quasi-direct or ideal+left=0.2+friction=2."
)


@dataclass(frozen=True)
class Condition:
    """Condition of a study; conditions with the same name are equal."""

    name: str
    """Canonical text, without the parts that have default values."""

    training: Training
    drives: Drives
    left: float
    """Share of the arm's weight that the controller deliberately does not carry [-]."""

    friction: float
    """Friction relative to the machine's own [-]."""

    @property
    def rig(self) -> str:
        """Machine of the training."""
        return "recupera_like" if self.drives == "harmonic" else "recupera_like_qdd"

    @property
    def has_motors(self) -> bool:
        """True if the condition has a machine with motors."""
        return self.training not in MOTORLESS


def condition_of(text: str) -> Condition:
    """Parse the name of a condition.

    Raises:
        ConfigError: The text is no condition; the error lists what is allowed.
    """
    found = _GRAMMAR.fullmatch(text.strip())
    if found is None:
        raise ConfigError(f"'{text}' is not a condition of a virtual study. {_ALLOWED}")
    training, drives = cast(Training, found["training"]), cast(Drives, found["drives"] or "harmonic")
    left, friction = float(found["left"] or 0.0), float(1.0 if found["friction"] is None else found["friction"])
    if left > 1.0 or friction > FRICTION_MAX:
        raise ConfigError(f"'{text}' is not a condition of a virtual study: a number is too large. {_ALLOWED}")
    if training in MOTORLESS and any(found[name] is not None for name in ("drives", "left", "friction")):
        raise ConfigError(f"'{text}' names drives, but '{training}' has no machine that carries. {_ALLOWED}")
    if training == "gcm" and left:
        raise ConfigError(f"'{text}' leaves a share of the arm's weight, but 'gcm' leaves all of it. {_ALLOWED}")
    name = training + ("" if drives == "harmonic" else f"@{drives}")
    name += (f"+left={left:g}" if left else "") + ("" if friction == 1.0 else f"+friction={friction:g}")
    return Condition(name, training, drives, left, friction)

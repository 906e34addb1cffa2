"""Progress of a calibration and of an identification, with the joint that moves and the remaining time."""

from collections.abc import Callable, Sequence
from types import MappingProxyType

from exograv.sentence import Sentence

from .sentences import say
from .view_models import Learning, WorkProgress

PARTS = MappingProxyType(
    {
        "calibration.still": (0.0, 0.01),
        "calibration.push": (0.01, 0.13),
        "calibration.sweep": (0.13, 0.86),
        "calibration.weight": (0.13, 0.86),
        "calibration.motion": (0.86, 0.86),  # no calibration of the pages has one
        "calibration.friction": (0.86, 0.98),
        "calibration.home": (0.98, 1.0),
    }
)
"""Begin and end of each kind of phase as shares of the time of a calibration of the default machine."""

ESTIMATED_FROM = 0.03
"""Share of the work from which the remaining time is estimated. Before it, the rate is too uncertain."""

MOVES_RAD_S = 0.02
"""Speed above which a joint counts as moving [rad/s]."""


class CalibrationProgress:
    """Listener of a calibration: it takes the sentences of the phases, and keeps the progress of the whole."""

    def __init__(self, now: Callable[[], float]):
        """Note the start, from which the remaining time is estimated. `now` is a function that returns a time [s]."""
        self._now, self._begun_s, self._share = now, now(), 0.0
        self.work = WorkProgress(
            kind="calibration", phase=say("flight.calibrates"), joint=None, share_done=0.0, left_s=None,
            why=say("work.calibration"),
        )  # fmt: skip
        """Progress so far."""

    def __call__(self, text: str, share: float) -> None:
        """Take the progress of one phase: its sentence, and its finished share."""
        if not isinstance(text, Sentence):
            return
        # A phase may consist of many short motions, and a share never falls.
        self._share = max(self._share, _share_of_whole(text, share))
        self.work = self.work.model_copy(
            update={
                "phase": text,
                "joint": text.fields.get("joint"),
                "share_done": self._share,
                "left_s": left_s(self._now() - self._begun_s, self._share),
            }
        )


def _share_of_whole(text: Sentence, share: float) -> float:
    begin, end = PARTS.get(text.code, (0.0, 0.0))
    number, of, part, span, parts = (int(text.fields.get(name, usual)) for name, usual in USUAL)
    # Pushes are many short motions, so only their joint counts.
    within = 0.0 if text.code == "calibration.push" else share
    return begin + (end - begin) * (number - 1 + (part + span * within) / parts) / of


USUAL = (("number", 1), ("of", 1), ("part", 0), ("span", 1), ("parts", 1))
"""Fields of a phase's sentence that give its place in the whole, with the values of a phase without them."""


def left_s(elapsed_s: float, share: float) -> float | None:
    """Remaining time of work that goes on at its present rate [s]; None while too little is done."""
    return elapsed_s * (1.0 - share) / share if share >= ESTIMATED_FROM else None


def identification_progress(
    learning: Learning | None, is_moving: bool, identify_s: float, joints: Sequence[str], v: Sequence[float]
) -> WorkProgress | None:
    """Progress of an identification; None while the machine does not move the arm.

    Args:
        learning: Progress of the estimate; None before its first report.
        is_moving: True if the machine moves the arm.
        identify_s: Duration of the motion [s].
        joints: Names of the joints.
        v: Velocity of each joint [rad/s].
    """
    if not is_moving:
        return None
    share = 0.0 if learning is None else learning.share_done
    fastest = max(range(len(joints)), key=lambda joint: abs(v[joint]), default=None)
    moves = fastest is not None and abs(v[fastest]) > MOVES_RAD_S
    phase = "begins" if learning is None else "over" if learning.is_over else "moves"
    return WorkProgress(
        kind="identification",
        phase=say(f"work.{phase}"),
        joint=joints[fastest] if moves and fastest is not None else None,
        share_done=share,
        left_s=(1.0 - share) * identify_s,
        why=say("work.identification", seconds=f"{identify_s:g}"),
    )

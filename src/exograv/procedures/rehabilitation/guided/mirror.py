"""Mirror therapy in one machine: the sound arm leads and floats freely. The other arm is led along its mirror image."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from exograv.loop.phases import FLOATING
from exograv.loop.tick_sample import ObservedMotion
from exograv.model.description import ArmSide

from .grip import DROP_S, GripOutcome
from .guided_arm import GuidedArms, Listener
from .mirror_guide import MirrorGuide
from .mirror_plan import MirrorPlan
from .repeat import SETTLE_S

MEETS_S = 3.0
"""Time from the coupling of the following arm until the leading arm moves, and both arms are compared [s]."""

Watch = Callable[[MirrorGuide, ObservedMotion], None]
"""Function that takes the guide and the motion of a tick."""


@dataclass(frozen=True)
class MirrorFigures:
    """Figures of a session of mirror therapy."""

    outcome: GripOutcome
    waited_s: float
    pull_max_Nm: np.ndarray


@dataclass
class MirrorResult:
    """Result of a session of mirror therapy."""

    state: GripOutcome = GripOutcome.FREE
    pull_max: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """Largest torque of the pull by joint; zero at the leading arm [N·m]."""
    waited_s: float = 0.0
    """Time during which the hands were too close together to proceed [s]."""

    @property
    def figures(self) -> MirrorFigures:
        """State at the end, waiting time [s] and largest pull by joint [N·m], rounded for `--json`."""
        return MirrorFigures(self.state, round(self.waited_s, 2), self.pull_max.round(3))


def mirror(
    flown: GuidedArms,
    lead: ArmSide,
    seconds: float,
    act: Callable[[], bool] = lambda: False,
    watch: Watch = lambda _guide, _moment: None,
) -> MirrorResult:
    """Let one arm follow the other for `seconds`. Both arms float afterwards, whatever the outcome.

    Args:
        flown: Both arms, floating.
        lead: Arm that leads.
        seconds: Duration from the moment when the following arm is gripped [s].
        act: Called in every tick, to act beside the machine; True if the arms must be released.
        watch: Called in every tick while one arm follows, to examine the guide.

    Raises:
        ConfigError: The machine does not have two arms that are mirror images.
        RigError: The envelope stopped the run.
    """
    return _Session(flown, lead, act, watch).mirror(seconds)


class _Session:
    """State of one session: both arms, callbacks and the result so far."""

    def __init__(self, flown: GuidedArms, lead: ArmSide, act: Callable[[], bool], watch: Watch):
        self._flown, self._act, self._watch = flown, act, watch
        self._plan = MirrorPlan.of(flown.assembly, lead)
        self._done, self._wants_out = MirrorResult(pull_max=np.zeros(len(flown.q))), False

    def mirror(self, seconds: float) -> MirrorResult:
        flown, done = self._flown, self._done
        flown.begin(FLOATING)
        if flown.run(SETTLE_S, "Both arms float", self._acting, None, lambda: self._wants_out):
            done.state = GripOutcome.RELEASED
            return done
        guide = self._plan.guide(flown.q, flown.period_s, flown.skeleton)
        listen = self._listener(guide)
        flown.begin("mirror")
        guide.lead()
        flown.lead(guide, listen)
        flown.run(seconds, "One arm follows the other", listen, guide, lambda: guide.has_let_go)
        done.state = GripOutcome.ENDED if guide.state is GripOutcome.LED else guide.state
        guide.let_go()
        flown.run(2.0 * DROP_S, "Releasing the arm", listen, guide)
        flown.begin(FLOATING)
        flown.float_again(guide, self._acting)
        return done

    def _listener(self, guide: MirrorGuide) -> Listener:
        done = self._done

        def listen(moment: ObservedMotion) -> None:
            self._acting(moment)
            if self._wants_out:
                guide.let_go()
            done.waited_s = guide.waited_s
            np.maximum(done.pull_max, np.abs(guide.tau), out=done.pull_max)
            self._watch(guide, moment)

        return listen

    def _acting(self, _moment: ObservedMotion) -> None:
        self._wants_out = self._act() or self._wants_out

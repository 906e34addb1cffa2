"""Mirror therapy in one machine: the sound arm leads and floats freely. The other arm is led along its mirror image."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.loop.phases import FLOATING
from exograv.loop.tick_sample import TickSample
from exograv.model.description import ArmSide

from .floating_arm import FloatingArm
from .grip import DROP_S, GripOutcome
from .mirror_guide import MirrorGuide
from .mirror_map import MirrorMap
from .path_shaping import allowed_range
from .pull import PullStrength
from .repeat import SETTLE_S

MIDDLE_M = 0.10
"""Least distance of the leading hand from the plane between the shoulders [m]. Closer hands could collide."""

LOOK_TICKS = 20
"""Ticks between two checks of the hands' positions."""


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
    flown: FloatingArm,
    lead: ArmSide,
    seconds: float,
    act: Callable[[], bool] = lambda: False,
    watch: Callable[[MirrorGuide], None] = lambda _guide: None,
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

    def __init__(
        self, flown: FloatingArm, lead: ArmSide, act: Callable[[], bool], watch: Callable[[MirrorGuide], None]
    ):
        self._flown, self._act, self._watch = flown, act, watch
        self._lead: ArmSide = lead
        assembly = flown.controller.assembly
        self._which = MirrorMap.of(assembly.description, assembly.exo, lead)
        self._strength = PullStrength.of(assembly.description)
        self._limits = allowed_range(assembly.description, assembly.exo)
        self._hands = _Hands(flown, lead)
        self._done, self._wants_out = MirrorResult(pull_max=np.zeros(len(flown.pilot.q))), False

    def mirror(self, seconds: float) -> MirrorResult:
        flown, pilot, done = self._flown, self._flown.pilot, self._done
        pilot.begin(FLOATING)
        if flown.run(SETTLE_S, "Both arms float", self._acting, None, lambda: self._wants_out):
            done.state = GripOutcome.RELEASED
            return done
        guide = MirrorGuide(self._which, self._strength, self._limits, pilot.q, pilot.rig.period_s)
        listen = self._listener(guide)
        pilot.begin("mirror")
        flown.controller.let_lead(self._lead)
        guide.lead()
        flown.lead(guide, listen)
        flown.run(seconds, "One arm follows the other", listen, guide, lambda: guide.has_let_go)
        done.state = GripOutcome.ENDED if guide.state is GripOutcome.LED else guide.state
        guide.let_go()
        flown.run(2.0 * DROP_S, "Releasing the arm", listen, guide)
        pilot.begin(FLOATING)
        flown.float_again(guide, self._acting)
        flown.controller.let_lead(None)
        return done

    def _listener(self, guide: MirrorGuide) -> Callable[[TickSample], None]:
        done, period_s, ticks = self._done, self._flown.pilot.rig.period_s, itertools.count()

        def listen(moment: TickSample) -> None:
            self._acting(moment)
            if self._wants_out:
                guide.let_go()
            if next(ticks) % LOOK_TICKS == 0:
                guide.waits = self._hands.to_middle(moment.q) < MIDDLE_M
            done.waited_s += period_s * guide.waits
            np.maximum(done.pull_max, np.abs(guide.tau), out=done.pull_max)
            self._watch(guide)

        return listen

    def _acting(self, _moment: TickSample) -> None:
        self._wants_out = self._act() or self._wants_out


class _Hands:
    """Position of the leading hand, by the controller's model."""

    def __init__(self, flown: FloatingArm, lead: ArmSide):
        self._controller = flown.controller
        limbs = flown.controller.assembly.arm.limbs
        self._is_first = limbs[0].side == lead

    def to_middle(self, q: Float[np.ndarray, " joint"]) -> float:
        """Distance from fingertip or wrist, the nearer one, to the plane between the shoulders [m].

        The distance is negative beyond the plane.
        """
        # The skeleton runs from the first arm's fingertip over both shoulders to the other fingertip
        # (`skeleton_function`).
        points = np.array(self._controller.skeleton(q)[1])
        if not self._is_first:
            points = points[::-1]
        half = len(points) // 2
        own, other = points[half - 1], points[half]
        across = (own - other) / np.linalg.norm(own - other)
        return float(((points[:2] - 0.5 * (own + other)) @ across).min())

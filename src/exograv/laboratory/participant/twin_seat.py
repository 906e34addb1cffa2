"""A participant in the twin, in front of its touch panel."""

import numpy as np

from exograv.rig.twin import Twin
from exograv.task.run import TaskRun
from exograv.task.task_settings import TargetSettings

from .interface import Participant
from .screen_session import EventSource, ScreenSession
from .touch_panel import TouchPanel
from .touch_screen import SimulatedRoom


class TwinSeat:
    """`Seat` in the twin."""

    def __init__(
        self, twin: Twin, participant: Participant, room: SimulatedRoom, target: TargetSettings, seed: int, page: str
    ):
        """Set up the panel without a touch. `seed` draws the delays of the panel."""
        self._twin, self._participant = twin, participant
        self._panel = TouchPanel(room, target, np.random.default_rng([seed, 32]), page)

    @property
    def is_relaxed(self) -> bool:
        """True if the participant's muscles give no torque."""
        return not self._twin.tau_voluntary.any()

    def session(self, run: TaskRun, *others: EventSource) -> ScreenSession:
        """Return the session of this participant. `others` are evaluated after the panel."""
        return ScreenSession(run, (self._panel.reported, *others), self._participant.see)

    def touch(self, t: float) -> None:
        """Detect at `t` [s] if the finger has come down on the panel."""
        off = self._panel.feel(t, self._twin.finger_on_screen())
        if off is not None:
            self._participant.touched(t, off)

    def act(self) -> None:
        """Give the participant's muscle torque to the twin."""
        twin = self._twin
        twin.tau_voluntary[:] = self._participant.act(twin.t, *twin.arm_motion())

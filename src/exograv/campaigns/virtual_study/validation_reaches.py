"""Reaches of a virtual participant without machine at one gravity, for the validation."""

from dataclasses import dataclass

import numpy as np

from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import Activity, PointingPerson
from exograv.signals import Command
from exograv.task.picture import ParticipantPicture
from exograv.task.protocol import load_protocol

from .session_setup import free_setup

REST_S, WINDOW_S, TAIL_S = 4.0, 22.0, 2.5
TICKS, LOOK_TICKS = 2, 20
"""Ticks of the twin between two acts of the person, and between two looks at the page."""

LIFT_S = 0.05


@dataclass(frozen=True)
class Landing:
    """Touch of the screen."""

    right_mm: float
    up_mm: float
    """Height above the target's centre [mm]."""

    took_s: float
    """Time from the start of the reach to the screen [s]."""

    peak_share: float
    """Share of that time until the hand was fastest [-]."""


class Reaching:
    """Reaches of one person without earlier experience."""

    def __init__(self, seed: int, gravity_level: float, sees: bool, habits: Habits | None = None, level: int = 2):
        """Begin at rest. A seed is the same person at every gravity; `sees` is True if a touch shows the finger."""
        stage = free_setup(seed, level, 0, gravity_level)
        room, protocol = SimulatedRoom(), load_protocol("training").settings
        self._twin, self._sees, self._task = stage.twin, sees, protocol.target
        self._target = room.on_panel(*room.target_px(protocol.target))
        self.person = PointingPerson(
            stage.own, stage.worn_inertia, stage.surroundings, self._target, protocol.pace.too_short.shape, seed,
            TICKS * self._twin.period_s, habits,
        )  # fmt: skip
        self.person.inner_ear = lambda: stage.twin.room_gravity
        self._still, self._ticks, self._last = np.zeros(len(self._twin.joints)), 0, -np.inf
        self._began, self._fastest, self._fastest_at = 0.0, 0.0, 0.0
        self._landed: list[Landing] = []

    def window(self, seconds: float = WINDOW_S) -> list[Landing]:
        """Rest, reach for `seconds`, rest again. Return the touches."""
        self._landed = []
        for screen, lasts_s in (("rest", REST_S), ("task", seconds), ("rest", TAIL_S)):
            ends = self._twin.t + lasts_s
            while self._twin.t < ends - 1e-9:
                # After the last window of a run, the countdown shows a time far away.
                self._tick(screen, ends - self._twin.t if lasts_s != TAIL_S else 100.0)
        return self._landed

    def _tick(self, screen: str, left_s: float) -> None:
        twin, person, was = self._twin, self.person, self.person.doing
        state = twin.read()
        twin.write(Command(twin.t, state.sequence, twin.t + 0.005, self._still, self._still))
        self._feel()
        if self._ticks % LOOK_TICKS == 0:
            person.see(twin.t, _picture(screen, left_s, self._task))
            speed = twin.hand_speed()
            if speed > self._fastest:
                self._fastest, self._fastest_at = speed, twin.t
        if self._ticks % TICKS == 0:
            truth = twin.truth
            twin.tau_voluntary[:] = person.act(twin.t, truth.q_arm, truth.v_arm)
        if was is not Activity.REACHING and person.doing is Activity.REACHING:
            self._began, self._fastest = twin.t, 0.0
        self._ticks += 1

    def _feel(self) -> None:
        twin, finger = self._twin, self._twin.finger_on_screen()
        if finger is None:
            return
        is_new, self._last = twin.t - self._last > LIFT_S, twin.t
        if not is_new or not self.person.is_under_way:
            return
        off, took_s = finger - self._target, twin.t - self._began
        share = (self._fastest_at - self._began) / took_s
        self._landed.append(Landing(float(1e3 * off[0]), float(1e3 * off[1]), took_s, share))
        self.person.touched(twin.t, off if self._sees else None)


def _picture(screen: str, left_s: float, target: object) -> ParticipantPicture:
    is_task = screen == "task"
    return ParticipantPicture.model_validate(
        {
            "screen": screen, "target": target if is_task else None, "diameter_px": 150.0 if is_task else None,
            "arrow": None, "countdown_s": left_s, "window": 1, "windows": 1,
        }
    )  # fmt: skip

"""Simulated touch panel: a finger that comes down is a touch, and the page reports it late."""

from collections import deque
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from exograv.task.events import Touch
from exograv.task.task_settings import TargetSettings

from .touch_screen import SimulatedRoom

LIFT_S = 0.05
"""Shortest time without contact before the next contact is another touch [s]. Touch panels debounce like this."""

OnScreen = Float[np.ndarray, " 2"]


class TouchPanel:
    """Contacts of a finger, and the reports that have not arrived yet."""

    def __init__(self, room: SimulatedRoom, target: TargetSettings, random: np.random.Generator, page: str):
        """Start without a touch. `random` draws the delays of the reports."""
        self._room, self._page, self._random = room, page, random
        self._target_px = room.target_px(target)
        self.target = room.on_panel(*self._target_px)
        """Place of the target, right and up of the panel's centre [m]."""
        self._reports: deque[Touch] = deque()
        self._count, self._last_contact = 0, -np.inf

    def feel(self, t: float, finger: OnScreen | None) -> OnScreen | None:
        """Process the finger's place, right and up of the centre [m], or None. Return a new touch's deviation [m].

        The result is None while the finger stays, is away, or bounces.
        """
        if finger is None:
            return None
        is_new, self._last_contact = t - self._last_contact > LIFT_S, t
        if not is_new:
            return None
        pixel = self._room.pixel_of(finger)
        if pixel is not None:
            self._report(t, pixel)
        return finger - self.target

    def put_target(self, x_px: float, y_px: float) -> None:
        """Take the place of the target from the picture on the panel."""
        self._target_px = x_px, y_px
        self.target = self._room.on_panel(x_px, y_px)

    def draw(self, t: float, off_mm: OnScreen) -> None:
        """Make a touch at `t` [s], at this distance right and up of the target [mm]."""
        right_px, up_px = (float(off) / self._room.pitch_mm for off in off_mm)
        self._report(t, (self._target_px[0] + right_px, self._target_px[1] - up_px))

    def reported(self, t: float) -> Iterator[Touch]:
        """Yield the touches that have arrived from the page until `t` [s], each once."""
        while self._reports and self._reports[0].received <= t:
            yield self._reports.popleft()

    @property
    def is_empty(self) -> bool:
        """True if every report has arrived."""
        return not self._reports

    def withdraw(self, since: float) -> None:
        """Drop the reports of touches from `since` on [s], because the participant did not make them."""
        self._reports = deque(touch for touch in self._reports if touch.t < since)

    def _report(self, t: float, pixel: tuple[float, float]) -> None:
        room = self._room
        at = t + max(room.touch_lag_s + room.touch_lag_sd_s * float(self._random.standard_normal()), 0.0)
        self._reports.append(
            Touch(
                t=at,
                received=at + room.delivery_s,
                page=self._page,
                sequence=self._count,
                x_px=pixel[0],
                y_px=pixel[1],
                target_x_px=self._target_px[0],
                target_y_px=self._target_px[1],
                contact_px=room.contact_mm / room.pitch_mm,
            )
        )
        self._count += 1

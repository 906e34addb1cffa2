"""Participant's page of a session, as a person sees and touches it."""

import time
from pathlib import Path
from typing import Any, NamedTuple, get_args

from exograv.errors import RigError
from exograv.task.picture import ParticipantPicture
from exograv.task.task_settings import Sign

from .devtools import DevTools

SEEN = (Path(__file__).parent / "seen.js").read_text(encoding="utf-8")
"""Script that reads what is visible on the page."""

CARD_MM = 85.6
"""Width of a bank card (ISO/IEC 7810) [mm]."""

SHOWS_S = 20.0
"""Time-out for the page that measures the panel [s]."""

PLACES = "target_px", "agree_px"
SCREENS = get_args(ParticipantPicture.model_fields["screen"].annotation)


class Sight(NamedTuple):
    """Content of the page at one time."""

    screen: str
    """Name of the screen, also one without a run, such as "idle" or "lost"; empty before the page is ready."""

    picture: ParticipantPicture | None
    """Picture of the run; None without a run."""

    target_px: tuple[float, float] | None
    """Centre of the drawn target, right and down of the panel's corner [px]."""

    unsent: int
    """Number of touches that the page has not delivered yet."""

    agree_px: tuple[float, float] | None = None
    """Centre of the button with which the participant agrees to a push; None without it [px]."""


class ParticipantPage:
    """Page of the participant on a touch panel of this size."""

    def __init__(self, browser: DevTools, link: str, panel_px: tuple[int, int]):
        """Open the link of the participant, which works once."""
        self._browser = browser
        width, height = panel_px
        for method, parameters in (
            ("Emulation.setDeviceMetricsOverride",
             {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}),
            ("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 1}),
            ("Page.navigate", {"url": link}),
        ):  # fmt: skip
            browser.call(method, **parameters)
        self._asked: int | None = None

    def calibrate(self, pitch_mm: float) -> None:
        """Measure the panel with a bank card, as a person does: open that page, fit the rectangle to the card, go back.

        Args:
            pitch_mm: True size of a pixel [mm].

        Raises:
            RigError: The page does not take the measurement.
        """
        self._do("location.href = '/participant/screen'")
        # The rectangle is drawn when the page can be used, and the button works while the session answers.
        self._wait_for(
            "document.getElementById('card')?.style.width > '' && !document.getElementById('use-card').disabled"
        )
        self._do(
            f"(() => {{ const width = document.getElementById('width'); width.value = {CARD_MM / pitch_mm};"
            " width.oninput(); document.getElementById('use-card').click(); })()"
        )
        self._wait_for("document.getElementById('found').dataset.taken === 'true'")
        self._do("document.querySelector('a.button[href=\"/participant/\"]').click()")

    def look(self) -> Sight | None:
        """Return what the page showed when the last look began, and look again; None while no look is complete.

        It never waits: a touch must not come late because the eyes are busy.
        """
        told = None if self._asked is None else self._browser.answer(self._asked)
        if self._asked is not None and told is None:
            return None
        self._asked = self._browser.ask("Runtime.evaluate", expression=SEEN, returnByValue=True)
        return None if told is None else _sight(told)

    def press(self, x_px: float, y_px: float, width_px: float) -> None:
        """Put a finger on the panel now; do not wait for the browser."""
        radius = 0.5 * width_px
        self._touch("touchStart", {"x": x_px, "y": y_px, "radiusX": radius, "radiusY": radius, "force": 0.5, "id": 1})

    def release(self) -> None:
        """Take the finger off the panel."""
        self._touch("touchEnd")

    def _touch(self, kind: str, *points: dict[str, float]) -> None:
        # The driver of a real panel gives the time to each touch. Without it the browser takes the time at which it
        # comes to read the command, which is milliseconds later on a busy computer.
        self._browser.tell("Input.dispatchTouchEvent", type=kind, touchPoints=list(points), timestamp=time.time())

    def _do(self, script: str) -> Any:
        told = self._browser.call("Runtime.evaluate", expression=script, returnByValue=True)
        return told.get("result", {}).get("value")

    def _wait_for(self, condition: str) -> None:
        until = time.monotonic() + SHOWS_S
        while not self._do(condition):
            if time.monotonic() > until:
                raise RigError("The participant's page does not take the measurement of the screen with a card.")
            time.sleep(0.05)


def _sight(told: dict[str, Any]) -> Sight:
    if "exceptionDetails" in told:
        raise RigError(f"The participant's page cannot be read: {told['exceptionDetails'].get('text', '')}.")
    seen = told["result"]["value"]
    picture = None
    if seen["screen"] in SCREENS:
        picture = ParticipantPicture(
            screen=seen["screen"],
            target=None,
            diameter_px=seen["diameter_px"],
            arrow=None if seen["shape"] is None else Sign(shape=seen["shape"], colour=seen["colour"]),
            countdown_s=_seconds(seen["countdown"]),
            window=None,
            windows=0,
        )
    target_px, agree_px = (None if seen[one] is None else (seen[one][0], seen[one][1]) for one in PLACES)
    return Sight(seen["screen"], picture, target_px, seen["unsent"], agree_px)


def _seconds(text: str) -> float | None:
    """Read a countdown such as "7" or "1:40" [s]."""
    minutes, _, seconds = text.rpartition(":")
    return 60.0 * float(minutes or 0) + float(seconds) if seconds else None

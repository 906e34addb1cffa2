"""Pages in a real Chromium, and a protocol of a few seconds."""

import time
from dataclasses import replace

from playwright.sync_api import Browser, Page
from playwright.sync_api import TimeoutError as PlaywrightTimeout
from tests.console.serving import Served

from exograv.console.keys import Role
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol
from exograv.task.screen import ScreenCalibration

TABLET = {"width": 1280, "height": 800}
RETURN_S = 0.35
PLOTS_PER_S = 30.0 * 0.9
"""The promised rate of the plots with 10 % tolerance: a page under test shares two cores with other processes."""

WIDTHS = ((390, 844), (820, 1180), (1400, 900))
TOUCH_MIN_PX = 40
"""Smallest height of a control that a finger hits surely, as the style sheet sets it (2.6 rem)."""

MISFITS = """(least) => {
  const found = [];
  for (const element of document.querySelectorAll("body *")) {
    const box = element.getBoundingClientRect();
    if (!element.checkVisibility() || box.width === 0) continue;
    const name = `${element.tagName}#${element.id} ${element.textContent.trim().slice(0, 20)}`;
    if (box.right > innerWidth + 1 || box.left < -1) found.push(`wider than the page: ${name}`);
    if (element.matches("button, select, .button") && box.height < least) found.push(`too small: ${name}`);
  }
  return found;
}"""

UNNAMED = """() => [...document.querySelectorAll("button, input, select, canvas, [role=img]")].filter((element) =>
  element.checkVisibility() && !element.textContent.trim() && !element.ariaLabel && !element.labels?.length
).map((element) => element.outerHTML)"""
"""Script that lists what a screen reader cannot name."""


def quick_plan(screen: ScreenCalibration | None = None) -> TaskPlan:
    """Plan with two windows of 8 s, the first after 2.5 s; the arrow changes within a second."""
    loaded = load_protocol("training")
    settings = loaded.settings
    windows = settings.windows.model_copy(update={"count": 2, "duration_s": 8.0})
    table = settings.rest_tables["cycle_180"].model_copy(update={"rest_s": 4.0})
    settings = settings.model_copy(
        update={
            "windows": windows,
            "rests": "quick",
            "rest_tables": {"quick": table},
            "before_first_s": 2.5,
            "after_last_s": 2.0,
            "ramps": settings.ramps.model_copy(update={"duration_s": 1.0, "hold_s": 0.5}),
            "pace": settings.pace.model_copy(update={"tolerance_s": 0.3}),
            "pointing": settings.pointing.model_copy(update={"return_after_s": RETURN_S}),
        }
    )
    return TaskPlan(replace(loaded, settings=settings), settings.exo, screen)


def misfits_of(page: Page) -> dict[int, list[str]]:
    """Return what is wider than the page or too small for a finger, by the width of the window."""
    found = dict[int, list[str]]()
    for width, height in WIDTHS:
        page.set_viewport_size({"width": width, "height": height})
        found[width] = page.evaluate(MISFITS, TOUCH_MIN_PX)
    return {width: misfits for width, misfits in found.items() if misfits}


class Visitor:
    """Visitor with a browser context of its own. An error in a page's script fails the test."""

    def __init__(self, browser: Browser, served: Served, role: Role, language: str = "en", **size: int):
        """Open the page of a role; `size` replaces the width and height of a tablet."""
        self.served, self.role = served, role
        viewport = {**TABLET, **size}
        self.context = browser.new_context(
            viewport={"width": viewport["width"], "height": viewport["height"]},
            has_touch=True,
            locale=language,
            device_scale_factor=1,
            # A certificate that a test makes for itself is not signed.
            ignore_https_errors=True,
        )
        self.page: Page = self.context.new_page()
        self.mistakes = list[str]()
        self.page.on("pageerror", lambda error: self.mistakes.append(str(error)))
        self.page.goto(served.link(role))
        self.page.locator("body[data-line=open]").wait_for()

    def sees(self, what: str, timeout_s: float = 8.0) -> None:
        """Wait for an element."""
        self.page.locator(what).first.wait_for(state="attached", timeout=1e3 * timeout_s)

    def press(self, what: str) -> None:
        """Click as soon as the element allows it."""
        self.page.locator(what).click(timeout=8000.0)

    def act(self, name: str, mode: str) -> None:
        """Press until the machine is in the mode, because an act that a busy computer delays by 0.5 s is refused."""
        for _ in range(6):
            self.press(f"[data-act={name}]")
            try:
                return self.sees(f"body[data-mode={mode}]", 3.0)
            except PlaywrightTimeout:
                continue
        raise AssertionError(f"{name} did not lead to {mode}")

    def close(self) -> None:
        """Close the browser context. No page may have had an error."""
        self.context.close()
        assert self.mistakes == [], self.mistakes


def take_arm(operator: Visitor) -> None:
    """Take the arm in two steps."""
    operator.act("make_ready", "exo_only")
    operator.act("take_arm", "floating")


def plots_per_s(operator: Visitor) -> float:
    """Measure the rate at which the operator's page draws its plots."""
    operator.page.locator("#legend button").first.wait_for()
    before, begun = operator.page.evaluate("drawnPlots()"), time.monotonic()
    time.sleep(3.0)  # In one second, one picture more or less would be an error of a thirtieth.
    return (operator.page.evaluate("drawnPlots()") - before) / (time.monotonic() - begun)

"""Pages in a real Chromium, and a protocol of a few seconds."""

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

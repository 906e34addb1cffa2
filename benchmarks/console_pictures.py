"""Pictures of all console pages for the documentation, from a console on the tests' mock desk.

    PYTHONPATH=. python benchmarks/console_pictures.py --out docs/pictures

Needs Chromium, as the browser tests do. Each picture shows one page at one moment: in a window with touches, in a
rest, in German, in a small window, after Stop.
"""

import argparse
import io
import tempfile
import time
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright
from tests.browser.conftest import ARGUMENTS, CHROMIUM
from tests.browser.of_browser import RETURN_S, Visitor, quick_plan
from tests.console.serving import Served, served

from exograv.console import broadcaster as news
from exograv.console import lease
from exograv.console.keys import Role
from exograv.task.screen import ScreenCalibration

COLOURS = 256
OFF_PX = ((14, -9), (-22, 5), (6, 17), (-8, -26), (31, 12), (2, -4), (-15, 20))
SCREEN = ScreenCalibration(pitch_x_mm=0.27, pitch_y_mm=0.27, method="card", anisotropy=0.0, relative_error=0.004)


def snap(visitor: Visitor, path: Path) -> None:
    """Save one screenshot, with few colours to keep the file small."""
    Image.open(io.BytesIO(visitor.page.screenshot())).convert("RGB").quantize(COLOURS).save(path, optimize=True)
    size = path.stat().st_size
    print(f"{path}  {size / 1000:.0f} kB")


def pictures(browser: Browser, house: Served, folder: Path) -> None:
    """Go through a whole session once and take all pictures."""
    house.desk.is_known = False
    operator = Visitor(browser, house, Role.OPERATOR, width=1440, height=1260)
    participant = Visitor(browser, house, Role.PARTICIPANT)
    snap(participant, folder / "participant_welcome.png")
    operator.press("[data-act=make_ready]")
    operator.press("[data-act=identify]")
    operator.page.locator("#outcome", has_text="The arm is identified.").wait_for()
    operator.press("[data-run=start]")
    participant.sees("body[data-screen=rest]")
    time.sleep(0.5)
    snap(participant, folder / "participant_rest.png")
    participant.sees("body[data-screen=task]")
    participant.sees("#arrow[data-shape=up]:not([hidden])")
    snap(participant, folder / "participant_too_long.png")
    for number, (dx, dy) in enumerate(OFF_PX):
        participant.page.touchscreen.tap(640.0 + dx, 400.0 + dy)
        if number == 0:
            participant.sees("#arrow[data-shape=down]:not([hidden])")
            snap(participant, folder / "participant_too_short.png")
        time.sleep(RETURN_S + 0.1)
    time.sleep(0.4)
    snap(operator, folder / "console.png")
    german = Visitor(browser, house, Role.VIEWER, "de", width=480, height=900)
    time.sleep(1.0)
    snap(german, folder / "console_small_german.png")
    participant.page.locator("#stop").tap()
    operator.sees("body[data-mode=safe]")
    time.sleep(0.5)
    snap(operator, folder / "console_stopped.png")
    operator.press("[data-run=end]")
    operator.press("[data-act=reset]")
    operator.sees("body[data-mode=off]")
    operator.close()
    therapist = Visitor(browser, house, Role.THERAPIST)
    for mode in ("exo_only", "floating"):
        therapist.page.locator("#next:enabled").click()
        therapist.sees(f"body[data-mode={mode}]")
        time.sleep(0.4)
    therapist.page.locator("#knob").fill("70")
    time.sleep(1.0)
    snap(therapist, folder / "one_knob.png")
    for name in ("screen", "latency"):
        participant.page.goto(f"{house.hub.origin}/participant/{name}")
        participant.sees("body[data-line=open]")
        time.sleep(0.3)
        snap(participant, folder / f"{name}.png")
    participant.page.goto(house.hub.origin + "/")
    time.sleep(0.3)
    snap(participant, folder / "enter.png")
    for visitor in (german, therapist, participant):
        visitor.close()


def main() -> None:
    """Draw all pictures again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    # One busy computer draws several pages here, and the machine has no wearer: longer limits are safe.
    lease.LEASE_S = news.ALARM_AFTER_S = 30.0
    with (
        tempfile.TemporaryDirectory() as diary,
        served(Path(diary), quick_plan(SCREEN)) as house,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        pictures(browser, house, folder)
        browser.close()


if __name__ == "__main__":
    main()

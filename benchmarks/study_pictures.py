"""Pictures of a study's report for the documentation.

    exograv study example --participants 3,3 --seed 1001 --out STUDY && exograv study report STUDY
    PYTHONPATH=. python benchmarks/study_pictures.py --study STUDY --out docs/pictures

Needs Chromium, as the browser tests do.
"""

import argparse
import io
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, sync_playwright
from tests.browser.conftest import ARGUMENTS, CHROMIUM

COLOURS = 64
PARTS = {
    "study_report": (900, "header", "#deviation"),
    "study_report_touches": (900, "#target", "#windows"),
    "study_report_phone": (400, "header", "#deviation"),
}
"""Width of the window [px], first and last part in the picture, by name of the picture."""


def snap(browser: Browser, html: Path, name: str, folder: Path) -> None:
    """Save one screenshot, with few colours to keep the file small."""
    width, first, last = PARTS[name]
    page = browser.new_page(viewport={"width": width, "height": 1000})
    page.goto(html.resolve().as_uri())
    boxes = [page.locator(part).first.bounding_box() for part in (first, last)]
    top, bottom = boxes[0], boxes[1]
    if top is None or bottom is None:
        raise SystemExit(f"{html} has no {first} or no {last}.")
    begin = 0.0 if first == "header" else top["y"]
    end = bottom["y"] + bottom["height"] + 10.0
    shot = page.screenshot(full_page=True, clip={"x": 0.0, "y": begin, "width": width, "height": end - begin})
    path = folder / f"{name}.png"
    Image.open(io.BytesIO(shot)).convert("RGB").quantize(COLOURS).save(path, optimize=True)
    print(f"{path}  {path.stat().st_size / 1000:.0f} kB")
    page.close()


def main() -> None:
    """Draw all pictures again."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for name in PARTS:
            snap(browser, options.study / "report" / "report.html", name, options.out)
        browser.close()


if __name__ == "__main__":
    main()

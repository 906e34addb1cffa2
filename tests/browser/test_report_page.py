"""A figure or table of a report that a small screen cuts off says so."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure
from playwright.sync_api import Browser

from exograv.report.style.page import Chapter, Page, Table, page_text

BOXES = """() => [...document.querySelectorAll(".scroll")].map((box) => [
  box.scrollWidth > box.clientWidth + 1, getComputedStyle(box, "::before").content.includes("sideways")
])"""
"""Script that lists for each box if a part of it is out of sight, and if it says so."""


@pytest.mark.parametrize(("width", "cut"), [(390, [True, True, False]), (1280, [False, False, False])])
def test_what_a_screen_cuts_off_has_a_hint_and_nothing_else_has(
    browser: Browser, tmp_path: Path, width: int, cut: list[bool]
):
    drawn = Figure(figsize=(9.6, 2.0))
    drawn.subplots().plot([1.0, 2.0])
    wide = Table([f"column {k}" for k in range(6)], [["0.123456789"] * 6])
    narrow = Table(("a", "b", "c"), [["1", "2", "3"]])
    chapters = [Chapter("Figure", [], "figure", drawn, "A line."), Chapter("Tables", [wide, narrow], "tables")]
    path = tmp_path / "report.html"
    path.write_text(page_text(Page("A headline", chapters, simulated="")), encoding="utf-8")
    page = browser.new_page(viewport={"width": width, "height": 844})
    page.goto(path.as_uri())
    assert page.evaluate(BOXES) == [[one, one] for one in cut]
    page.close()

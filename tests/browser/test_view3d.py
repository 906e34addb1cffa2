"""The person in the machine is seen in a real Chromium, moves with the joints, and is missed with a sentence."""

import io
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console.keys import Role
from exograv.console.view_page import ViewData, served_page, single_page
from exograv.console.view_recording import recorded_view
from exograv.console.view_server import page_server
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.scene import describe_scene
from exograv.safety.modes import Mode

from .conftest import ARGUMENTS, Visit, chromium
from .of_browser import PLOTS_PER_S, UNNAMED, misfits_of, plots_per_s, take_arm

DRAWN_MS = 60_000
"""Time in which a busy computer without a graphics card draws one picture."""

CHANGED = 12
"""Difference of a pixel's brightness that is seen, of 255."""

UNTIL_DRAWN = """before => new Promise(done => {
  const look = () => (drawnPictures() > before ? done() : setTimeout(look, 20));
  look();
})"""
"""Script that waits for a picture. Playwright's own waiting evaluates a text, which the pages' policy refuses."""

STOP_S = 0.5
"""Time from the key to the machine's safe state, which a busy computer needs at most."""

OFF = "HTMLCanvasElement.prototype.getContext = () => null;"


# These tests alone have WebGL. See WITHOUT_3D.
@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium(ARGUMENTS) as browser:
        yield browser


@contextmanager
def served_view(data: ViewData) -> Iterator[str]:
    with page_server(served_page(data), 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """Page of its own. A mistake in a script, or a file that the policy refuses, fails the test."""
    mistakes = list[str]()
    with browser.new_context(viewport={"width": 1000, "height": 700}) as context:
        page = context.new_page()
        page.on("pageerror", lambda error: mistakes.append(str(error)))
        page.on("console", lambda said: mistakes.append(said.text) if "Content Security" in said.text else None)
        yield page
    assert mistakes == []


def machine(name: str, side: str | None = None) -> ViewData:
    description = load_rig(name, side)  # pyright: ignore[reportArgumentType] - a side of this machine
    return ViewData(name, "", describe_scene(description, Body(1.75, 75.0, "male")))


def after(page: Page, act: Callable[[], object]) -> None:
    """Act, and wait until the picture is drawn again."""
    before = page.evaluate("drawnPictures()")
    act()
    page.evaluate(UNTIL_DRAWN, before)


def picture(page: Page) -> np.ndarray:
    page.evaluate(UNTIL_DRAWN, 0)
    image = page.locator("#scene").screenshot(timeout=DRAWN_MS)
    return np.asarray(Image.open(io.BytesIO(image)).convert("L"), dtype=float)


def share_changed(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.mean(np.abs(one - other) > CHANGED))


@pytest.mark.parametrize(("name", "joint"), [("recupera_like", "elbow_flexion"), ("recupera_like_7", "wrist_flexion")])
def test_a_machine_is_drawn_and_a_slider_moves_it(name: str, joint: str, page: Page):
    with served_view(machine(name)) as address:
        page.goto(address)
        before = picture(page)
        assert before.std() > 20.0, "a box of one colour"
        slider = page.locator(f"[data-joint={joint}]")
        after(page, lambda: slider.evaluate("one => { one.value = one.min; one.dispatchEvent(new Event('input')); }"))
        moved = picture(page)
        assert 0.001 < share_changed(before, moved) < 0.2, "the arm alone moves, not the person"
        after(page, lambda: page.locator("#rest").click())
        assert share_changed(before, picture(page)) < 0.0005


def test_arrow_keys_turn_the_whole_picture(page: Page):
    with served_view(machine("recupera_like_dual")) as address:
        page.goto(address)
        before = picture(page)
        page.locator("#scene canvas").focus()
        for _ in range(4):
            after(page, lambda: page.keyboard.press("ArrowRight"))
        assert share_changed(before, picture(page)) > 0.05


def test_a_recording_in_one_file_opens_without_a_server_and_plays(page: Page, tmp_path: Path):
    file = tmp_path / "page.html"
    file.write_text(single_page(recorded_view(Path("examples/data/floating.mcap"), None, None)), encoding="utf-8")
    page.goto(file.as_uri())
    before = picture(page)
    assert page.locator("#simulated").is_visible()
    assert page.locator("#clock").text_content() == "0.00 of 9.61 s"
    seek = "one => { one.value = 9; one.dispatchEvent(new Event('input')); }"
    after(page, lambda: page.locator("#time").evaluate(seek))
    assert share_changed(before, picture(page)) > 0.002
    assert "N·m" in (page.locator("#joints output").nth(1).text_content() or "")
    page.locator("#speed").select_option("4")
    page.locator("#play").click()
    page.locator("#play", has_text="Play").wait_for(timeout=DRAWN_MS)
    assert page.locator("#clock").text_content() == "9.61 of 9.61 s"


def test_without_webgl_a_sentence_is_in_the_place_of_the_picture(page: Page):
    page.add_init_script(OFF)
    with served_view(machine("recupera_like")) as address:
        page.goto(address)
        assert "WebGL is off or missing" in (page.locator("#scene .scene-without").text_content() or "")
        assert page.locator("#scene canvas").count() == 0
        page.locator("[data-joint=elbow_flexion]").focus()
        page.keyboard.press("ArrowRight")


def test_the_operator_sees_the_person_move_in_the_machine(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    operator.page.locator("#scene canvas").scroll_into_view_if_needed()
    before = picture(operator.page)
    assert before.std() > 20.0
    after(operator.page, lambda: setattr(house.desk, "began", house.desk.began - 4.0))
    after(operator.page, lambda: None)
    assert share_changed(before, picture(operator.page)) > 0.0005


@pytest.mark.long
def test_plots_keep_their_rate_beside_a_picture_that_a_processor_draws(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    operator.page.locator("#scene canvas").scroll_into_view_if_needed()
    operator.page.evaluate(UNTIL_DRAWN, 0)
    before = operator.page.evaluate("drawnPictures()")
    assert plots_per_s(operator) >= PLOTS_PER_S
    assert operator.page.evaluate("drawnPictures()") > before


def test_a_stop_is_taken_at_once_while_the_picture_is_drawn(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    take_arm(operator)
    operator.page.locator("#scene canvas").focus()
    for _ in range(3):
        after(operator.page, lambda: operator.page.keyboard.press("ArrowRight"))
    operator.page.keyboard.press("ArrowRight")
    begun = time.monotonic()
    operator.page.keyboard.press("Escape")
    wait_until(lambda: house.desk.machine.mode is Mode.SAFE)
    assert time.monotonic() - begun < STOP_S


@pytest.mark.parametrize("language", ["en", pytest.param("de", marks=pytest.mark.long)])
def test_the_picture_fits_its_page_and_has_a_name(house: Served, visit: Visit, language: str):
    visitor = visit(Role.VIEWER, language)
    visitor.page.evaluate(UNTIL_DRAWN, 0)
    assert misfits_of(visitor.page) == {}
    assert visitor.page.evaluate(UNNAMED) == []
    name = {"en": "Person in the machine", "de": "Person in der Maschine"}[language]
    assert visitor.page.locator("#scene canvas").get_attribute("aria-label") == name


def test_the_picture_is_for_pages_of_the_machine_only(house: Served, visit: Visit):
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT)
    fetched = "async path => (await fetch(path)).status"
    assert operator.page.evaluate(fetched, "/operator/scene") == 200
    assert participant.page.evaluate(fetched, "/operator/scene") == 403
    assert participant.page.evaluate(fetched, "/participant/scene") == 404

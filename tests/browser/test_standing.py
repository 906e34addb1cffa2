"""Pages say at once what is uncertain: a simulated machine, long work, a lost lease, a lost line, an ended session."""

import json

import pytest
from playwright.sync_api import Route
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console import lease
from exograv.console.keys import Role
from exograv.console.page_files import PAGES
from exograv.console.server import MORE_OF_PARTICIPANT
from exograv.experiment.steered.sentences import say
from exograv.experiment.steered.view_models import WorkProgress
from exograv.procedures.calibration.phase_texts import say as calibration
from exograv.safety.modes import Event
from exograv.task.events import Start

from .conftest import Visit
from .of_browser import Visitor, misfits_of, take_arm

LANGUAGES = ("en", "de")
IN_BOTH = pytest.mark.parametrize("language", ["en", pytest.param("de", marks=pytest.mark.long)])
WORDS = {name: json.loads((PAGES / "words" / f"{name}.json").read_text(encoding="utf-8")) for name in LANGUAGES}


@IN_BOTH
def test_every_page_shows_in_both_languages_that_the_machine_is_simulated(house: Served, visit: Visit, language: str):
    visitor = visit(Role.PARTICIPANT, language)
    for path in ("participant/", *(f"participant/{name}" for name in MORE_OF_PARTICIPANT), ""):
        visitor.page.goto(f"{house.hub.origin}/{path}")
        visitor.page.locator("#simulated", has_text=WORDS[language]["simulated.banner"]).wait_for()
    for role in (Role.OPERATOR, Role.VIEWER, Role.THERAPIST):
        page = visit(role, language).page
        page.locator("#simulated", has_text=WORDS[language]["simulated.banner"]).wait_for()
        page.close()  # Open pages draw plots all the time.


@IN_BOTH
def test_nothing_is_wider_than_its_page_or_too_small_for_a_finger(house: Served, visit: Visit, language: str):
    misfits = dict[str, list[str]]()
    for role in Role:
        visitor = visit(role, language)
        more = MORE_OF_PARTICIPANT if role is Role.PARTICIPANT else ()
        for path in (f"{role.value}/", *(f"participant/{name}" for name in more)):
            visitor.page.goto(f"{house.hub.origin}/{path}")
            visitor.sees("body[data-line=open]")
            visitor.page.locator("#simulated", has_text=WORDS[language]["simulated.banner"]).wait_for()
            misfits |= {f"{path} at {width}": found for width, found in misfits_of(visitor.page).items()}
        visitor.page.close()
    assert misfits == {}


def joint_name(language: str) -> str:
    return {"en": "elbow flexion", "de": "Ellbogen: Beugung"}[language]


@IN_BOTH
@pytest.mark.parametrize("role", [Role.OPERATOR, Role.THERAPIST])
def test_a_calibration_shows_phase_joint_bar_remaining_time_and_reason(
    house: Served, visit: Visit, role: Role, language: str
):
    page = visit(role, language).page
    page.locator("#work").wait_for(state="hidden")
    text = calibration("calibration.sweep", joint="elbow_flexion", number=2, of=4)
    house.desk.work = WorkProgress(
        kind="calibration", phase=text, joint="elbow_flexion", share_done=0.42, left_s=37.0, why=say("work.calibration")
    )
    page.locator("#work").wait_for()
    shown = {name: page.locator(f"#work-{name}").inner_text() for name in ("title", "phase", "joint", "left", "why")}
    assert joint_name(language) in shown["phase"]
    assert joint_name(language) in shown["joint"]
    assert shown["title"] == WORDS[language]["work.calibration"]
    assert shown["left"].startswith("42 % · ")
    assert "37 s" in shown["left"]
    assert len(shown["why"]) > 80
    assert page.locator("#work-bar").evaluate("bar => bar.value") == pytest.approx(0.42)
    house.desk.work = None
    page.locator("#work").wait_for(state="hidden")


def test_a_browser_that_was_too_slow_is_named_to_the_operator_and_to_the_participant(
    house: Served, visit: Visit, monkeypatch: pytest.MonkeyPatch
):
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT)
    take_arm(operator)
    monkeypatch.setattr(lease, "LEASE_S", 1.2)
    operator.page.evaluate("() => { const end = Date.now() + 3000; while (Date.now() < end); }")
    operator.page.locator("#lost", has_text="its browser was too slow").wait_for()
    operator.page.locator("#alarms li", has_text="its browser was too slow").wait_for()
    participant.page.locator("#notice", has_text="The computer of your operator was too slow.").wait_for()
    monkeypatch.setattr(lease, "LEASE_S", 8.0)
    operator.press("#steer")
    operator.page.locator("#lost").wait_for(state="hidden")
    participant.page.locator("#notice").wait_for(state="hidden")


@pytest.mark.long
def test_the_page_that_lost_the_lease_is_told_who_took_over(
    house: Served, visit: Visit, monkeypatch: pytest.MonkeyPatch
):
    first, second = visit(Role.OPERATOR), visit(Role.OPERATOR, "de")
    first.sees("body[data-steers=true]")
    monkeypatch.setattr(lease, "LEASE_S", 1.2)
    first.page.evaluate("() => { const end = Date.now() + 3000; while (Date.now() < end); }")
    monkeypatch.setattr(lease, "LEASE_S", 8.0)
    second.page.locator("#lost", has_text="ihr Browser war zu langsam").wait_for()
    second.press("#steer")
    second.sees("body[data-steers=true]")
    first.page.locator("#lost", has_text="has taken over.").wait_for()
    assert second.page.locator("#lost").is_hidden()


def float_in_window(house: Served) -> None:
    """Let the arm float and the protocol run, without a page: a busy computer may delay pages for seconds."""

    def begin() -> None:
        for event in (Event.TEST, Event.PASSED, Event.TAKE_ARM, Event.ARRIVED):
            house.desk.machine.take(event)
        assert house.hub.trial is not None
        house.hub.trial.run.feed(Start(t=house.desk.now()))

    house.loop.call_soon_threadsafe(begin)


def assert_nothing_old(visitor: Visitor) -> None:
    """Check that a page without a line shows no value as present and offers no act."""
    page = visitor.page
    page.locator("#away").wait_for()
    if visitor.role is Role.PARTICIPANT:
        page.locator("#headline", has_text="Please wait").wait_for()
        assert page.locator("#target").is_hidden()
        assert page.locator("#countdown").inner_text() == ""
        return
    assert page.locator("#mode").inner_text() == "Unknown"
    assert page.locator(".needs-line:enabled").count() == 0
    assert page.locator("#stop").is_enabled()


def test_an_ended_session_shows_at_once_on_all_pages(house: Served, visit: Visit):
    visitors = [visit(role) for role in Role]
    float_in_window(house)
    visitors[0].sees("body[data-mode=floating]", 20.0)
    house.server.should_exit = True
    for visitor in visitors:
        visitor.sees("body[data-line=ended]", 20.0)
        text = visitor.page.locator("#away").inner_text()
        assert "The session has ended" in text, visitor.role
        assert_nothing_old(visitor)


def test_a_line_lost_while_the_picture_of_the_machine_is_fetched_is_no_error(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    page = operator.page
    held = list[Route]()

    def hold(route: Route) -> None:
        held.append(route)

    page.route("**/scene", hold)
    page.reload()
    operator.sees("body[data-line=open]")
    for _ in range(200):
        if held:
            break
        page.wait_for_timeout(50)
    page.route("**/ticket", lambda route: route.abort())
    house.cut_off(operator.role)
    operator.sees("body[data-line=gone]", 20.0)
    held[0].continue_()
    page.wait_for_timeout(300)  # An error of the page fails the test when it closes.


@pytest.mark.long
def test_a_server_that_is_killed_leaves_no_old_value_on_any_page(house: Served, visit: Visit):
    visitors = [visit(role) for role in Role]
    float_in_window(house)
    visitors[0].sees("body[data-mode=floating]", 20.0)
    for visitor in visitors:
        visitor.page.route("**/ticket", lambda route: route.abort())
        house.cut_off(visitor.role)
        visitor.sees("body[data-line=gone]", 20.0)
        assert_nothing_old(visitor)
    # The same pages come back by themselves.
    for visitor in visitors:
        visitor.page.unroute("**/ticket")
        visitor.sees("body[data-line=open]", 20.0)
        assert visitor.page.locator("#away").is_hidden()
    visitors[0].page.locator("#mode", has_text="The arm floats").wait_for()


def test_a_machine_that_reports_nothing_any_more_is_not_shown_as_it_was(house: Served, visit: Visit):
    operator, therapist = visit(Role.OPERATOR), visit(Role.THERAPIST)
    house.desk.age_s = 4.2
    operator.page.locator("#latch", has_text="No report from the machine for 4 s").wait_for()
    therapist.page.locator("#why", has_text="No report from the machine for 4 s").wait_for()
    house.desk.age_s = 0.0
    wait_until(lambda: "No report" not in operator.page.locator("#latch").inner_text())

"""Roles in the browser: two operators, a participant who tries to start, a screen measurement, one knob, languages."""

import time
from collections.abc import Callable

import pytest
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console.keys import Role
from exograv.console.permissions import MAY
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason

from .conftest import Visit
from .of_browser import UNNAMED, Visitor, take_arm


def test_the_second_operator_watches_until_the_first_is_gone(house: Served, visit: Visit):
    first, second = visit(Role.OPERATOR), visit(Role.OPERATOR)
    first.sees("body[data-steers=true]")
    second.sees("body[data-steers=false]")
    assert second.page.locator("[data-act=make_ready]").is_disabled()
    assert second.page.locator("#steer").is_hidden()
    first.page.close()
    second.press("#steer")
    second.sees("body[data-steers=true]")
    second.press("[data-act=make_ready]")
    wait_until(lambda: house.desk.machine.mode is Mode.EXO_ONLY)


def test_a_participant_page_that_sends_start_is_refused_and_the_operator_is_told(house: Served, visit: Visit):
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT)
    take_arm(operator)
    start = {"kind": "run", "id": "12345678", "made": 1.0, "word": "start"}
    # A person who opens the browser's tools can open a further line with the page's cookie.
    answer = participant.page.evaluate(
        """async (start) => {
            const asked = await fetch("/participant/ticket", { method: "POST", headers: { "X-Exograv": "1" } });
            const { ticket } = await asked.json();
            const socket = new WebSocket(`ws://${location.host}/participant/line`);
            await new Promise((settle) => (socket.onopen = settle));
            socket.send(JSON.stringify({ kind: "hello", ticket, page: "tools-of-browser" }));
            socket.send(JSON.stringify(start));
            return new Promise((settle) => {
                socket.onmessage = (event) => {
                    const message = JSON.parse(event.data);
                    if (message.kind === "answer") settle(message.answer);
                };
            });
        }""",
        start,
    )
    assert answer["taken"] is False
    assert "run" not in MAY[Role.PARTICIPANT]
    operator.page.locator("#alarms li", has_text="participant page asked for 'run'").wait_for()
    assert house.hub.trial is not None
    assert house.hub.trial.run.state.status == "ready"


def test_a_link_that_was_used_opens_nothing_any_more(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    operator.press("[data-invite=viewer]")
    operator.page.locator("#link:not([hidden])").wait_for()
    link = operator.page.locator("#link code").inner_text()
    viewer = operator.context.browser.new_context().new_page()  # pyright: ignore[reportOptionalMemberAccess]
    viewer.goto(link)
    viewer.wait_for_url("**/viewer/")
    viewer.locator("body[data-mode=off]").wait_for()
    assert viewer.locator("[data-act=make_ready]").is_hidden()
    other = operator.context.browser.new_context().new_page()  # pyright: ignore[reportOptionalMemberAccess]
    other.goto(link)
    other.locator("#said", has_text="used already").wait_for()
    viewer.context.close()
    other.context.close()


def test_a_screen_is_measured_with_a_card_and_the_target_is_as_large_as_the_protocol_says(house: Served, visit: Visit):
    participant = visit(Role.PARTICIPANT)
    participant.page.goto(f"{house.hub.origin}/participant/screen")
    participant.sees("body[data-line=open]")
    participant.page.locator("#width").fill("428")
    participant.press("#use-card")
    participant.page.locator("#found", has_text="0.2").wait_for()
    assert house.hub.trial is not None
    assert house.hub.trial.plan.screen is not None
    assert house.hub.trial.plan.screen.pitch_x_mm == pytest.approx(0.2)
    participant.page.fill("#length", "0.001")
    participant.press("#ruler button")
    participant.page.locator("#found", has_text="30 mm").wait_for()


def choose(visitor: Visitor, where: str, option: str, is_taken: Callable[[], bool]) -> None:
    """Choose as a person does: again, if the page has shown a newer state meanwhile and the choice was refused."""

    def taken() -> bool:
        if not is_taken():
            visitor.page.locator(f"{where}:enabled").select_option(option)
            time.sleep(0.3)
        return is_taken()

    wait_until(taken)
    time.sleep(0.3)  # Wait for the new state: an act for an older state is refused.


def test_one_knob_supports_the_arm_and_the_other_button_stops_it(house: Served, visit: Visit):
    therapist = visit(Role.THERAPIST)
    choose(therapist, "#side", "left", lambda: house.desk.side == "left")
    choose(therapist, "#person", "T02", lambda: house.desk.participant == "T02")
    for _ in range(2):
        therapist.page.locator("#next:enabled").wait_for()
        mode = house.desk.machine.mode
        therapist.press("#next")
        wait_until(lambda before=mode: house.desk.machine.mode is not before)
        time.sleep(0.3)
    therapist.sees("body[data-mode=floating]")
    assert therapist.page.locator("#side").is_disabled()
    therapist.page.locator("#knob").fill("60")
    wait_until(lambda: house.desk.level_asked == pytest.approx(0.4))
    therapist.page.locator("#support-percent", has_text="60\xa0%").wait_for()
    therapist.page.locator("#stop").tap()
    therapist.sees("body[data-mode=safe]")
    assert therapist.page.locator("main button:visible").count() == 2


@pytest.mark.parametrize("role", Role)
def test_pages_speak_german_and_name_what_they_show_to_a_screen_reader(house: Served, visit: Visit, role: Role):
    visitor = visit(role, "de")
    visitor.page.wait_for_function("document.documentElement.lang === 'de'")
    visitor.page.locator("#stop", has_text="Stopp").wait_for()
    if role is Role.OPERATOR:
        house.desk.alarm(StopReason.STOP_PRESSED.sentence)
        visitor.page.locator("#alarms li", has_text="Stopp wurde gedrückt.").wait_for()
        visitor.page.locator("#legend button", has_text="Schulter: Abspreizen").wait_for()
    assert visitor.page.evaluate(UNNAMED) == []

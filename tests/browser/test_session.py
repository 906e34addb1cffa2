"""A whole session in the browser: login, two steps, eight touches, the arrow, Stop."""

import itertools
import time

from tests.console.serving import Served

from exograv.console.keys import Role
from exograv.safety.modes import Mode

from .conftest import Visit
from .of_browser import PLOTS_PER_S, RETURN_S, plots_per_s, take_arm


def accepted(house: Served) -> int:
    assert house.hub.trial is not None
    return house.hub.trial.operator(house.desk.now()).totals.accepted


def test_an_operator_takes_the_arm_and_starts_and_a_participant_touches_eight_times(house: Served, visit: Visit):
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT)
    assert operator.page.url == f"{house.hub.origin}/operator/"
    assert "#" not in operator.page.url
    participant.sees("body[data-screen=welcome]")
    take_arm(operator)
    operator.press("[data-run=start]")
    participant.sees("body[data-screen=rest]")
    participant.sees("body[data-screen=task]")
    shapes = set[str | None]()
    box = participant.page.locator("#target").bounding_box()
    assert box is not None
    assert (round(box["width"]), round(box["height"])) == (150, 150)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    arrow = participant.page.locator("#arrow")
    # The first touches are slow, so that the arrow shows all its shapes.
    arrow.and_(participant.page.locator("[data-shape=up]:not([hidden])")).wait_for()
    shapes.add(arrow.get_attribute("data-shape"))
    for number in range(8):
        participant.page.touchscreen.tap(x + 3.0, y + 4.0)
        if number == 0:
            participant.page.locator("#arrow[data-shape=down]:not([hidden])").wait_for()
            shapes.add(arrow.get_attribute("data-shape"))
            assert arrow.get_attribute("data-colour") == "red"
        time.sleep(RETURN_S + 0.15)
    assert shapes == {"up", "down"}
    assert accepted(house) == 8
    touches = [message for topic, _, message in house.desk.written if topic == "/task" and message["kind"] == "touch"]
    assert {round(touch["deviation_px"], 3) for touch in touches} == {5.0}
    operator.page.locator("#totals", has_text="8 touches, 8 counted").wait_for()
    # In the window the arm is weightless. The level was requested along a ramp.
    levels = [act.gravity_level for act in house.desk.taken if act.kind == "set_level"]
    assert levels[-1] == 0.0
    assert all(0.0 <= a - b < 0.35 for a, b in itertools.pairwise(levels))
    participant.sees("body[data-screen=rest]")


def test_stop_of_the_participant_lets_the_arm_down_and_nothing_starts_by_itself(house: Served, visit: Visit):
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT)
    take_arm(operator)
    operator.press("[data-run=start]")
    participant.sees("body[data-screen=task]")
    stop = participant.page.locator("#stop")
    assert stop.inner_text() == "Stop"
    stop.tap()
    operator.sees("body[data-mode=safe]")
    participant.sees("body[data-screen=paused]")
    assert house.desk.machine.mode is Mode.SAFE
    # A finger on Stop is not recorded as a touch of the task.
    assert all(topic != "/console/touch" for topic, _, _ in house.desk.written)
    operator.page.locator("#alarms li").first.wait_for()
    operator.press("[data-act=reset]")
    operator.sees("body[data-mode=off]")
    time.sleep(0.3)
    assert house.desk.machine.mode is Mode.OFF
    operator.page.locator("#alarms button").first.click()
    operator.page.locator("#alarms li").first.wait_for(state="detached")


def test_plots_are_drawn_thirty_times_a_second_where_no_browser_shows_the_machine(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    assert plots_per_s(operator) >= PLOTS_PER_S
    assert operator.page.locator("#legend button").count() == 4


def test_an_arm_that_is_not_known_is_identified_and_its_intervals_close(house: Served, visit: Visit):
    house.desk.is_known = False
    operator = visit(Role.OPERATOR)
    operator.act("make_ready", "exo_only")
    operator.press("[data-act=identify]")
    operator.page.locator("#parameters .estimate").first.wait_for()
    operator.page.locator("#outcome", has_text="The arm is identified.").wait_for()
    width = operator.page.locator("#parameters .now").first.get_attribute("width")
    prior = operator.page.locator("#parameters .prior").first.get_attribute("width")
    assert width is not None
    assert prior is not None
    assert float(width) < 0.2 * float(prior)


def test_a_note_and_a_level_reach_the_desk(house: Served, visit: Visit):
    operator = visit(Role.OPERATOR)
    take_arm(operator)
    operator.press("[data-support='62']")
    operator.page.fill("#note-text", "calm")
    operator.press("#note button")
    operator.page.locator("#support-asked", has_text="Requested: support 62\xa0% (felt weight 38\xa0%)").wait_for()
    assert [act.text for act in house.desk.taken if act.kind == "note"] == ["calm"]

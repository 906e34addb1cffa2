"""A lost connection, a reload, a closed browser and two hands lose no touch and corrupt no record."""

import time

import pytest
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console.keys import Role

from .conftest import Visit
from .of_browser import RETURN_S, Visitor, take_arm


def kept(visitor: Visitor) -> int:
    return visitor.page.evaluate("JSON.parse(localStorage.getItem('touches') ?? '[]').length")


def in_task(visit: Visit) -> tuple[Visitor, Visitor]:
    """Open the pages of an operator and of a participant whose window is open."""
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT)
    take_arm(operator)
    operator.press("[data-run=start]")
    participant.sees("body[data-screen=task]")
    return operator, participant


def totals(house: Served):
    assert house.hub.trial is not None
    return house.hub.trial.operator(house.desk.now()).totals


def test_touches_without_a_line_wait_outlive_a_reload_and_count_where_they_fell(house: Served, visit: Visit):
    _, participant = in_task(visit)
    # Without tickets and with the line cut, the network is lost.
    participant.page.route("**/ticket", lambda route: route.abort())
    house.cut_off(Role.PARTICIPANT)
    participant.page.locator("#away:not([hidden])").wait_for()
    for _ in range(3):
        participant.page.touchscreen.tap(645.0, 400.0)
        time.sleep(RETURN_S + 0.15)
    assert kept(participant) == 3
    assert totals(house).touches == 0
    participant.page.unroute("**/ticket")
    participant.page.reload()
    participant.page.locator("body[data-line=open]").wait_for()
    wait_until(lambda: totals(house).accepted == 3)
    wait_until(lambda: kept(participant) == 0)
    assert set(totals(house).rejected) <= {"repeated"}


OF_SENDING = """async () => {
  const { Touches } = await import("/files/touches.js");
  const kept = new Map();
  const storage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) };
  const touches = new Touches(storage);
  touches.add({ page: "p", sequence: 1 });
  const numbers = (now) => touches.message(now)?.touches.map((touch) => touch.sequence) ?? [];
  const found = [numbers(0)];
  touches.sent(touches.message(0), 0);
  touches.add({ page: "p", sequence: 2 });
  found.push(numbers(600));
  touches.sent(touches.message(600), 600);
  found.push(numbers(699), numbers(700));
  touches.acknowledge("p", 1);
  found.push(numbers(1299), numbers(1300));
  return found;
}"""


def test_a_touch_is_sent_again_only_when_its_acknowledgement_is_overdue(visit: Visit):
    participant = visit(Role.PARTICIPANT)
    assert participant.page.evaluate(OF_SENDING) == [[1], [2], [], [1], [], [2]]


@pytest.mark.long
def test_a_browser_that_is_closed_in_a_window_stops_nothing_and_may_come_back(house: Served, visit: Visit):
    operator, participant = in_task(visit)
    participant.page.touchscreen.tap(645.0, 400.0)
    wait_until(lambda: totals(house).accepted == 1)
    participant.page.close()
    wait_until(lambda: all(line.role is not Role.PARTICIPANT for line in house.hub.lines.values()))
    participant.page = participant.context.new_page()
    participant.page.goto(f"{house.hub.origin}/participant/")
    participant.sees("body[data-line=open]")
    participant.sees("body[data-screen=task]")
    operator.sees("body[data-mode=floating]")


def test_a_palm_and_a_second_finger_are_kept_with_their_reason(house: Served, visit: Visit):
    _, participant = in_task(visit)
    devtools = participant.context.new_cdp_session(participant.page)

    def press(*points: dict[str, float]) -> None:
        devtools.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": list(points)})
        devtools.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def refused() -> dict[str, int]:
        # Touches without an acknowledgement in time are sent again.
        return {why: count for why, count in totals(house).rejected.items() if why != "repeated"}

    press({"x": 640.0, "y": 400.0, "radiusX": 120.0, "radiusY": 90.0})
    wait_until(lambda: refused() == {"palm": 1})
    press({"x": 640.0, "y": 400.0, "radiusX": 4.0, "radiusY": 4.0, "id": 0}, {"x": 700.0, "y": 500.0, "id": 1})
    wait_until(lambda: refused() == {"palm": 1, "second": 1} and totals(house).accepted == 1)
    raw = [message for topic, _, message in house.desk.written if topic == "/console/touch"]
    assert raw[0]["width_px"] >= 200.0
    assert raw[0]["pointer"] == "touch"
    # The page is isolated from all others, so timestamps have steps of 5 µs.
    assert participant.page.evaluate("crossOriginIsolated")


@pytest.mark.long
def test_an_operator_who_is_cut_off_comes_back_and_steers(house: Served, visit: Visit):
    operator, _ = in_task(visit)
    first = house.hub.lease.holder
    house.cut_off(Role.OPERATOR)
    wait_until(lambda: house.hub.lease.holder not in (None, first))
    operator.sees("body[data-line=open]")
    operator.page.locator("#alarms li", has_text="it was closed or reloaded, or its connection broke.").wait_for()


def test_the_page_neither_zooms_nor_scrolls_nor_selects(house: Served, visit: Visit):
    participant = visit(Role.PARTICIPANT)
    participant.page.mouse.wheel(0.0, 500.0)
    participant.page.keyboard.press("Control++")
    participant.page.mouse.dblclick(640.0, 300.0)
    assert participant.page.evaluate("[scrollY, visualViewport.scale, String(getSelection())]") == [0, 1, ""]

"""The same session engine runs a protocol on any machine, hands records to sinks, and can end runs without a clock."""

from dataclasses import dataclass, field

import numpy as np

from exograv.laboratory.participant.screen_session import ScreenSession
from exograv.laboratory.participant.touch_panel import TouchPanel
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.task.events import OpenWindow, Start
from exograv.task.plan import TaskPlan
from exograv.task.protocol import first_windows, load_protocol
from exograv.task.records import Record, RunEnded, TouchRecord
from exograv.task.run import TaskRun

STEP_S = 0.5
ROOM = SimulatedRoom()


@dataclass
class Steps:
    """Machine that only has a clock, and settles for some steps after the end."""

    t: float = 0.0
    settling: int = 0
    told: list[float] = field(default_factory=list)

    @property
    def is_settling(self) -> bool:
        return self.settling > 0

    def advance(self, session: ScreenSession) -> None:
        self.settling -= session.run.state.status in ("finished", "stopped")
        self.t += STEP_S
        self.told.append(self.t)
        session.tell(self.t)

    def why_over(self, run: TaskRun) -> str:
        return "all windows are complete" if run.is_over(self.t) else ""


def run_of(protocol: str) -> tuple[TaskRun, TouchPanel, list[Record]]:
    loaded, records = first_windows(load_protocol(protocol), 1), list[Record]()
    plan = TaskPlan(loaded, loaded.settings.exo, ROOM.calibration)
    panel = TouchPanel(ROOM, loaded.settings.target, np.random.default_rng(3), "simulated")
    return TaskRun(plan, sinks=(lambda _t, more: records.extend(more),)), panel, records


def test_a_clock_ends_its_run_and_the_machine_goes_on_until_it_has_settled():
    run, panel, records = run_of("training")
    run.feed(Start(t=0.0))
    opens = run.plan.timeline.windows[1].start_s
    panel.draw(opens + 3.0, np.array([10.0, 5.0]))
    machine = Steps(settling=4)
    ScreenSession(run, (panel.reported,)).fly(machine)
    assert run.state.status == "finished"
    assert machine.settling == 0
    (touch,) = [record for record in records if isinstance(record, TouchRecord)]
    assert touch.is_accepted
    np.testing.assert_allclose(np.array([touch.deviation_x_mm, touch.deviation_y_mm], float), [10.0, -5.0], atol=1e-9)
    assert panel.is_empty


def test_a_run_without_a_clock_is_stopped_once_when_the_machine_says_so():
    run, panel, records = run_of("flight")
    run.feed(Start(t=0.0))
    opened = iter([OpenWindow(t=1.0, by="aircraft")])

    def aircraft(t: float) -> list[OpenWindow]:
        return [event for event in [next(opened, None)] if event is not None] if t >= 1.0 else []

    machine = Steps()
    seen = list[float]()
    session = ScreenSession(run, (panel.reported, aircraft), lambda t, _picture: seen.append(t))
    machine.why_over = lambda run: "the aircraft has landed" if machine.t >= 10.0 else ""
    session.fly(machine)
    (end,) = [record for record in records if isinstance(record, RunEnded)]
    assert (end.t, end.why) == (10.0, "the aircraft has landed")
    assert seen == machine.told


def test_touches_that_a_closed_window_does_not_take_are_withdrawn():
    _run, panel, _records = run_of("training")
    panel.draw(1.0, np.zeros(2))
    panel.draw(5.0, np.zeros(2))
    panel.withdraw(4.0)
    assert [touch.sequence for touch in panel.reported(10.0)] == [0]

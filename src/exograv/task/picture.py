"""Content of the pages at a time: only the task for the participant, the course of the run for the operator."""

from typing import Literal

from exograv.model.rig_settings import Settings

from .pace import arrow, pace
from .plan import TaskPlan
from .schedule import Phase, PhaseKind
from .state import RunAlarm, RunState, Status, WindowState
from .task_settings import Sign, TargetSettings
from .totals import Quartiles, Totals, quartiles, totals


class ParticipantPicture(Settings):
    """Content of the participant's page at one time."""

    screen: Literal["welcome", "rest", "task", "paused", "end"]
    target: TargetSettings | None
    diameter_px: float | None
    """Diameter of the target on this panel [px]."""

    arrow: Sign | None
    countdown_s: float | None
    """Time to the opening of the next window, or to the end of the open one. None if it is unknown."""

    window: int | None
    """Number of the open window, or of the next one; None if no window follows."""

    windows: int
    asks_consent: bool = False
    """True if the participant has to agree before the machine pushes the arm down."""


class WindowPicture(Settings):
    """Summary of one window, or of one attempt at it."""

    number: int
    attempt: int
    is_open: bool
    is_complete: bool
    touches: int
    accepted: int
    deviation_px: Quartiles | None
    deviation_mm: Quartiles | None
    marks: tuple[str, ...]


class OperatorPicture(Settings):
    """Content of the operator's page. It does not show if the machine is a sham."""

    status: Status
    phase: PhaseKind
    gravity_level: float | None
    """Level that the protocol states for this time; None while the schedule is stopped."""

    countdown_s: float | None
    window: int | None
    windows: tuple[WindowPicture, ...]
    totals: Totals
    left_s: float | None
    """Time to the end of the schedule; None if an aircraft or the operator opens the windows."""

    alarms: tuple[RunAlarm, ...]
    """Alarms that the operator has not acknowledged yet."""

    is_feed_lost: bool


def participant_picture(plan: TaskPlan, state: RunState, t: float) -> ParticipantPicture:
    """Content of the participant's page at `t`, not before the last event and not after the clock's next one."""
    screens: dict[Status, Literal["welcome", "rest", "paused", "end"]] = {
        "ready": "welcome",
        "running": "rest",
        "paused": "paused",
        "stopped": "end",
        "finished": "end",
    }
    window, target = state.window, plan.protocol.target
    shown = None
    diameter_px = None
    if window is not None:
        since = window.opened if window.cycle.last_touch is None else window.cycle.last_touch
        shown = arrow(plan.protocol, pace(plan.protocol, t - since))
        diameter_px = target.diameter_px if plan.screen is None else target.diameter_mm / plan.screen.pitch_x_mm
    return ParticipantPicture(
        screen=screens[state.status] if window is None else "task",
        target=None if window is None else target,
        diameter_px=diameter_px,
        arrow=shown,
        countdown_s=_countdown_s(plan, state, t),
        window=_window(plan, state),
        windows=plan.protocol.windows.count,
    )


def operator_picture(plan: TaskPlan, state: RunState, t: float) -> OperatorPicture:
    """Content of the operator's page at `t`, not before the last event and not after the clock's next one."""
    counts = state.status == "running" and plan.is_clocked
    phase = _phase(plan, state, t)
    kind = PhaseKind.WINDOW if state.window is not None else PhaseKind.REST
    return OperatorPicture(
        status=state.status,
        phase=kind if phase is None else phase.kind,
        gravity_level=None if phase is None else phase.level_at(t - state.origin),
        countdown_s=_countdown_s(plan, state, t),
        window=_window(plan, state),
        windows=tuple(map(_window_picture, state.windows)),
        totals=totals(state),
        left_s=max(state.origin + plan.timeline.duration_s - t, 0.0) if counts else None,
        alarms=tuple(alarm for alarm in state.alarms if not alarm.is_acknowledged),
        is_feed_lost=state.is_feed_lost,
    )


def _phase(plan: TaskPlan, state: RunState, t: float) -> Phase | None:
    """Phase of the schedule; None while the schedule is stopped."""
    counts = state.status == "running" and plan.is_clocked and t >= state.approach and state.phase >= 0
    return plan.timeline.phases[state.phase] if counts else None


def _window(plan: TaskPlan, state: RunState) -> int | None:
    if state.window is not None:
        return state.window.number
    if state.status == "running" and plan.is_clocked:
        coming = plan.timeline.phases[max(state.phase, 0) :]
        return next((phase.window for phase in coming if phase.kind is PhaseKind.WINDOW), None)
    return state.next_window(plan.protocol.windows.numbers)


def _countdown_s(plan: TaskPlan, state: RunState, t: float) -> float | None:
    if state.status != "running":
        return None
    number = _window(plan, state)
    if not plan.is_clocked:
        window = state.window
        return None if window is None else max(window.opened + plan.protocol.windows.duration_s - t, 0.0)
    if number is None:
        return None
    planned = plan.timeline.windows[number]
    until_s = planned.start_s if state.window is None else planned.end_s
    return max(state.origin + until_s - t, 0.0)


def _window_picture(window: WindowState) -> WindowPicture:
    in_mm = [value for value in window.deviations_mm if value is not None]
    return WindowPicture(
        number=window.number,
        attempt=window.attempt,
        is_open=window.closed is None,
        is_complete=window.is_complete,
        touches=window.touches,
        accepted=len(window.deviations_px),
        deviation_px=quartiles(list(window.deviations_px)),
        deviation_mm=quartiles(in_mm),
        marks=window.marks,
    )

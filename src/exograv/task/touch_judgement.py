"""Judgement of a touch: one record per touch, in the window of the contact, also for touches that arrive late."""

from .events import Touch
from .pace import Pace, pace
from .plan import TaskPlan
from .pointing import AHEAD_MAX_S, RejectionReason, deviation, too_soon, touched, unfit
from .records import Record, TouchRecord, extended
from .state import RunState
from .timed_transitions import Step, tell_pace


def judge(plan: TaskPlan, state: RunState, touch: Touch) -> Step:
    """Return state and records after a touch has arrived."""
    index = state.window_at(touch.t)
    reason = _reason(plan, state, touch, index)
    interval_s = None if index is None else touch.t - _counted_from(state, index)
    state = state.seeing(touch)
    record = _record(plan, state, touch, index, reason, interval_s)
    if reason is not None or index is None:
        return _rejected(state, index, reason or RejectionReason.OUTSIDE), (record,)
    window = state.windows[index]
    state = state.with_window(
        index,
        cycle=touched(window.cycle, touch.t),
        touches=window.touches + 1,
        deviations_px=(*window.deviations_px, record.deviation_px),
        deviations_mm=(*window.deviations_mm, record.deviation_mm),
    ).model_copy(update={"touches": state.touches + 1})
    if window.closed is not None:
        return state, (record,)
    # A touch that arrived late gives the pace for the time that has passed since its contact.
    told = pace(plan.protocol, state.t - touch.t)
    state, more = tell_pace(plan, state, state.t, told) if told is not state.pace else (state, ())
    records: tuple[Record, ...] = (record, *more)
    return state, records


def _reason(plan: TaskPlan, state: RunState, touch: Touch, index: int | None) -> RejectionReason | None:
    if state.has_seen(touch):
        return RejectionReason.REPEATED
    if touch.t > touch.received + AHEAD_MAX_S:
        return RejectionReason.UNTIMED
    if index is None:
        return RejectionReason.OUTSIDE
    return unfit(plan.protocol, plan.screen, touch) or too_soon(plan.protocol, state.windows[index].cycle, touch.t)


def _counted_from(state: RunState, index: int) -> float:
    window = state.windows[index]
    return window.opened if window.cycle.last_touch is None else window.cycle.last_touch


def _rejected(state: RunState, index: int | None, reason: RejectionReason) -> RunState:
    rejected = {**state.rejected, reason: state.rejected.get(reason, 0) + 1}
    if reason is RejectionReason.REPEATED:  # The finger came down once: it is no further touch.
        return state.model_copy(update={"rejected": rejected})
    if index is not None:
        state = state.with_window(index, touches=state.windows[index].touches + 1)
    return state.model_copy(update={"touches": state.touches + 1, "rejected": rejected})


def _record(
    plan: TaskPlan,
    state: RunState,
    touch: Touch,
    index: int | None,
    reason: RejectionReason | None,
    interval_s: float | None,
) -> TouchRecord:
    window = None if index is None else state.windows[index]
    told: Pace | None = None if interval_s is None else pace(plan.protocol, interval_s)
    return extended(
        touch,
        TouchRecord,
        **deviation(touch, plan.screen)._asdict(),
        window=None if window is None else window.number,
        attempt=None if window is None else window.attempt,
        is_accepted=reason is None,
        reason=reason,
        interval_s=interval_s,
        pace=told,
    )

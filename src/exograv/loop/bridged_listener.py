"""Ticks without a measurement, filled for the listeners of a run by interpolation."""

from collections.abc import Callable
from typing import Any

from exograv.signals import Reference

from .tick_sample import TickSample

BRIDGED_TICKS = 20
"""Largest number of ticks between two samples over which a motion is interpolated. After more, its listeners restart,
or the guard has let the arm down."""


class BridgedListener:
    """Listener that also receives interpolated ticks between two measurements that are not neighbours.

    Listeners filter and differentiate with the period of the machine. Without the missing ticks the motion of several
    periods would be one period's, and the filter would make an acceleration of it that never was.
    """

    def __init__(self, listener: Callable[[TickSample], None] | None):
        """Begin before the first tick of a run; without a listener nothing happens."""
        self._listener = listener
        self._last: TickSample | None = None
        self._missing = 0

    def pass_on(self, moment: TickSample | None) -> None:
        """Pass on one tick as it is; None if it brought no trustworthy measurement."""
        if self._listener is not None and moment is not None:
            self._listener(moment)

    def take(self, moment: TickSample | None) -> None:
        """Pass on one tick and, before it, those that are missing since the last one."""
        if self._listener is None:
            return
        if moment is None:
            self._missing += 1
            return
        last, ticks = self._last, self._missing + 1
        if last is not None and ticks <= BRIDGED_TICKS:
            for tick in range(1, ticks):
                self._listener(between(last, moment, tick / ticks))
        self._listener(moment)
        self._last, self._missing = copied(moment), 0


def between(last: TickSample, moment: TickSample, share: float) -> TickSample:
    """Interpolate what was measured and requested linearly; all else is that of `moment`."""

    def mixed(a: Any, b: Any) -> Any:
        return a + share * (b - a)

    state = moment.state._replace(
        t=mixed(last.state.t, moment.state.t),
        q=mixed(last.state.q, moment.state.q),
        current=mixed(last.state.current, moment.state.current),
    )
    return moment._replace(
        state=state,
        q=mixed(last.q, moment.q),
        v=mixed(last.v, moment.v),
        tau_measured=mixed(last.tau_measured, moment.tau_measured),
        reference=Reference(*(mixed(a, b) for a, b in zip(last.reference, moment.reference, strict=True))),
    )


def copied(moment: TickSample) -> TickSample:
    """Copy what `between` reads: the next tick overwrites the arrays."""
    state = moment.state._replace(q=moment.state.q.copy(), current=moment.state.current.copy())
    return moment._replace(
        state=state,
        q=moment.q.copy(),
        v=moment.v.copy(),
        tau_measured=moment.tau_measured.copy(),
        reference=Reference(*(one.copy() for one in moment.reference)),
    )

"""Ticks without a measurement, filled for the listeners of a run by interpolation."""

from collections.abc import Callable
from typing import Any

import numpy as np

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
        self._last: tuple[float, np.ndarray] | None = None
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
        t, values, ticks = moment.state.t, values_of(moment), self._missing + 1
        if self._last is not None and ticks <= BRIDGED_TICKS:
            for share in np.arange(1, ticks) / ticks:
                now = between(self._last[0], t, share), between(self._last[1], values, share)
                self._listener(with_values(moment, *now))
        self._listener(moment)
        self._last, self._missing = (t, values), 0


def between(a: Any, b: Any, share: float) -> Any:
    """Interpolate two numbers or arrays linearly."""
    return a + share * (b - a)


def values_of(moment: TickSample) -> np.ndarray:
    """Copy what was measured and requested (8 * joint,): the next tick overwrites the arrays."""
    return np.concatenate(
        (moment.state.q, moment.state.current, moment.q, moment.v, moment.tau_measured, *moment.reference)
    )


def with_values(moment: TickSample, t: float, values: np.ndarray) -> TickSample:
    """Return the tick with another time [s] and other values of `values_of`."""
    q_measured, current, q, v, tau, *reference = values.reshape(8, -1)
    state = moment.state._replace(t=t, q=q_measured, current=current)
    return moment._replace(state=state, q=q, v=v, tau_measured=tau, reference=Reference(*reference))

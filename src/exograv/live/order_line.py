"""Procedure's end of the memory between a procedure and control: orders to control, and the ticks that follow them."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from exograv.errors import RigError
from exograv.loop.bridged_listener import BRIDGED_TICKS, between
from exograv.loop.pilot import Progress
from exograv.motion import Planned
from exograv.runtime.processes.shared_memory import MessageRing, Ring

from .live_procedure import OVER, LiveFloat
from .procedure_orders import Order, OrderMemory, written_order

Joints = np.ndarray
FollowedTick = Callable[[int, Joints, Joints], object]
"""Function that takes a tick on a path: its number, and the measured positions [rad] and torques [N·m]."""


class OrderLine:
    """Orders of one run, numbered, and the ticks that control carries out."""

    def __init__(self, orders: MessageRing, followed: Ring):
        """Begin with number 1."""
        self._orders, self._followed = orders, followed
        self._number = self._taken = 0

    def send(self, floating: LiveFloat, *, is_led: bool, is_load_known: bool = True, **more: Any) -> int:
        """Send an order to control, with the fields of `Order` in `more`, and return its number.

        Raises:
            RigError: Control takes no orders any more.
        """
        self.new_rows()  # Ticks of an earlier order must not fill the ring.
        self._number += 1
        order = Order(self._number, is_led, is_load_known=is_load_known, **more)
        floating.write("/control", floating.t, {"act": "order", **written_order(order)})  # for a replay
        if not self._orders.put(order):
            raise RigError(OVER)
        return self._number

    def new_rows(self) -> np.ndarray:
        """Take the ticks that have arrived, and free their places."""
        rows = self._followed.take()
        self._taken += len(rows)
        self._followed.acknowledge(self._taken)
        return rows

    def watch(
        self, floating: LiveFloat, number: int, path: Planned, heard: FollowedTick, progress: Callable[[float], object]
    ) -> None:
        """Give each tick on the path of an order to `heard`, until its end; a few missing ticks are interpolated.

        Args:
            floating: Machine.
            number: Number of the order.
            path: Path of the order.
            heard: Function that takes each tick.
            progress: Function that takes the share of the path that is done.

        Raises:
            RigError: As `LiveFloat.wait`.
        """
        before, seen = np.zeros((2, len(floating.q))), -1
        while seen < len(path) - 1:
            floating.wait()
            for tick, values in self._ticks(number):
                if tick >= len(path):
                    seen = tick
                    break
                ticks = tick - seen if seen >= 0 and tick - seen <= BRIDGED_TICKS else 1
                for k in range(1, ticks + 1):
                    heard(tick - ticks + k, *between(before, values, k / ticks))
                before, seen = values, tick
            progress(max(min(seen / len(path), 1.0), 0.0))

    def _ticks(self, number: int) -> Iterator[tuple[int, Joints]]:
        """Yield the new ticks on the path of an order: number on the path, position and torque (2, joint)."""
        for row in self.new_rows():
            if row["order"] == number and row["tick"] >= 0:
                yield int(row["tick"]), np.array([row["q"], row["tau"]])


def order_line(joints: int, stack: contextlib.ExitStack) -> tuple[OrderLine, OrderMemory]:
    """Create the memory between a procedure and control; return the procedure's end, and the memory for control.

    The memory lives as long as `stack`.
    """
    size = OrderMemory(joints)
    orders = stack.enter_context(contextlib.closing(size.order_ring()))
    followed = stack.enter_context(contextlib.closing(size.followed_ring()))
    return OrderLine(orders, followed), replace(size, orders=orders.name, followed=followed.name)


def shown_as(text: str, progress: Progress) -> Callable[[float], object]:
    """Return the function that shows the share of a path under a text."""
    return lambda share: progress(text, share)

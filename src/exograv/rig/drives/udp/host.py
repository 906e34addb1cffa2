"""A machine behind a laboratory's own controller: our clock asks it once in every period, and what is late is lost."""

import math
import time
from collections import Counter
from collections.abc import Callable
from functools import cache
from itertools import chain
from typing import Any, ClassVar

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.driver import ENABLE_S, Asked, Driver
from exograv.rig.drives.node import Node
from exograv.rig.drives.settings import Drive, Drives, UdpBus
from exograv.signals import Command

from .layout import STATE_JOINT, DriveFlag, Flag, is_newer
from .link import CODE, CURRENT, FAULT, MOTOR_POSITION, POSITION, PRESENT, STATUS, TEMPERATURE, Link
from .nameplate import refuse_other_controller

LOST_S = 0.005
"""Without any answer, all joints are lost: five periods, after the three that a guard bridges, and before the first
drive's watchdog [s]."""

PATIENCE_S = 0.3
"""For a controller that is asked who it is: several watchdogs, after which whoever had it before has let it go [s]."""

FAULTS, STATUSES = sum(DriveFault), sum(DriveFlag)
"""Bits that we know."""
STEP = len(STATE_JOINT)


class UdpNode(Node):
    """Drive of one joint, as its controller says; faults are held against it there."""

    def __init__(self, drive: Drive):
        super().__init__(drive, 1)
        self.current, self.fault = math.nan, DriveFault.LOST

    @property
    def is_on(self) -> bool:
        """True if the drive gives the torque that it is told."""
        return self.is_wanted

    def take(self, said: tuple[Any, ...]) -> None:
        """Its part of a state; where it was not heard, its position is that of before."""
        self._misses, self.code, self.temperature_C = 0, said[CODE], said[TEMPERATURE]
        self.is_wanted, self.fault = _bits(said[STATUS] & STATUSES, said[FAULT] & FAULTS)
        if said[STATUS] & PRESENT:
            self.position, self.motor_position, self.current = said[POSITION], said[MOTOR_POSITION], said[CURRENT]
        else:
            self.current = 0.0

    def miss(self, is_lost: bool) -> None:
        """No state has come for this tick, or for so long that it is lost."""
        self._misses = 1
        if is_lost:
            self.hold_against(DriveFault.LOST)


class UdpRig(Driver[UdpNode]):
    """`read` polls the controller and waits for its answer, `write` sends it a current and a damping for each drive."""

    answer_share: ClassVar[float] = 0.4

    def __init__(self, drives: Drives, answer_s: float | None = None, lock_step: bool = False, first_sequence: int = 0):
        """Send nothing before `with`; arguments as `Driver`.

        Args:
            drives: Of the machine.
            answer_s: How long `read` waits for the controller at most [s].
            lock_step: True if time is counted in periods.
            first_sequence: Of our packets; tests begin close to the wrap.

        Raises:
            ConfigError: They are on another bus.
        """
        udp = drives.table(UdpBus)
        super().__init__(drives, [UdpNode(drive) for drive in drives.each], answer_s, lock_step)
        self._link = Link((udp.host, udp.port), len(drives.joints), first_sequence)
        self._no_current = (0.0,) * (2 * len(drives.joints))
        self._heard_at, self._taken = -math.inf, 0

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        self._is_on = False
        for _ in range(3):  # one may be lost; the watchdog is behind all of them
            self._link.command(self._state.sequence, self.t, 0.0, Flag.NONE, self._no_current)

    @property
    def _is_open(self) -> bool:
        return True  # a datagram needs no connection; the link refuses by itself

    def _open(self) -> None:
        self._link.open()

    def _begin(self) -> None:
        """Shake hands, and wait for a first measurement."""
        refuse_other_controller(self._link.hello(PATIENCE_S), self._drives)
        ends = self.t + PATIENCE_S
        self._heard_at = -math.inf
        while self._heard_at == -math.inf:
            self.read()
            if self.t > ends:
                raise RigError(
                    f"The controller at {self._link.address[0]}:{self._link.address[1]} says who it is, and does not "
                    f"answer a poll within {1e3 * self._answer_s:g} ms. Is it busy, or the network? Counted: "
                    f"{dict(self.counts)}."
                )

    def _close(self) -> None:
        self._link.close()

    def _link_counts(self) -> Counter[str]:
        return self._link.counts

    def _ask(self, now: Asked, answer_s: float) -> Asked | None:
        until = time.monotonic() + answer_s
        self._link.poll(now.tick, now.t)
        answer = self._link.collect(now.tick, until)
        if answer is None:
            for node in self._nodes:
                node.miss(now.t - self._heard_at > LOST_S)
            return None
        self._heard_at, self._taken = answer.t, answer.packet.own[0]
        for k, node in enumerate(self._nodes):
            node.take(answer.packet.joints[STEP * k : STEP * (k + 1)])
        return Asked(answer.t, answer.tick)

    def _tell(self, command: Command, currents: list[float], damping: list[float]) -> None:
        told = tuple(chain.from_iterable(zip(currents, damping, strict=True)))
        flags, now = Flag.ENABLE if self._is_on else Flag.NONE, self.t
        life_s = min(command.valid_until - now, self._drives.watchdog_s)
        if life_s <= 0.0 or self._link.command(command.sequence, now, life_s, flags, told) is None:
            self._expired += 1

    def _refresh(self) -> None:
        self.read()
        if self.t - self._heard_at > self._drives.watchdog_s:  # restarted, perhaps
            self._begin()

    def _switch_on(self) -> None:
        ends = self.t + ENABLE_S
        # More than once: a computer that stalls for a watchdog's time just then has switched nothing on.
        while not self._try_to_switch_on(ends) and self.t < ends:
            pass
        self._refuse_off()

    def _try_to_switch_on(self, ends: float) -> bool:
        """Off, faults acknowledged, on; True if all has been done until then [s]."""
        return (
            self._tell_until(Flag.NONE, ends, lambda node: not node.is_on)
            and self._tell_until(Flag.ACKNOWLEDGE, ends, lambda node: not node.fault)
            and self._tell_until(Flag.ENABLE, ends, lambda node: node.is_on)
        )

    def _tell_until(self, flags: Flag, ends: float, is_done: Callable[[UdpNode], bool]) -> bool:
        """Ask for no torque, once in each period, until every drive has done it, or it is then [s].

        Where one that is to go on has a fault again, nothing more is waited for.
        """
        first: list[int] = []

        def are_done() -> bool:
            # Only what was said after it took one of these commands tells what they did.
            return bool(first) and not is_newer(first[0], self._taken) and all(map(is_done, self._nodes))

        def is_over() -> bool:
            return are_done() or (bool(first) and flags is Flag.ENABLE and any(node.fault for node in self._nodes))

        def tell() -> None:
            life_s = self._drives.watchdog_s
            told = self._link.command(self._state.sequence, self.t, life_s, flags, self._no_current)
            if told is not None and not first:
                first.append(told)

        self._each_period(ends, is_over, tell)
        return are_done()


@cache  # of ten bits at most; enumerations are slow to make in every tick
def _bits(status: int, fault: int) -> tuple[bool, DriveFault]:
    """True for a drive that is on, and its faults."""
    if not status & DriveFlag.PRESENT:
        return False, DriveFault(fault) | DriveFault.LOST
    return bool(status & DriveFlag.ENABLED), DriveFault(fault)

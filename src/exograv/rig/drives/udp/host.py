"""Driver of a machine behind a laboratory's own controller, which is polled once per period by this computer's clock.

A late answer counts as lost.
"""

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
from .link import CODE, CURRENT, FAULT, MOTOR_POSITION, POSITION, PRESENT, SAMPLES, STATUS, TEMPERATURE, Link
from .nameplate import agreed_nameplates

LOST_S = 0.005
"""Time without any answer after which all joints are lost [s].

It is five periods: more than the three that a guard bridges, and less than the first drive's watchdog.
"""

STALE_S = 0.02
"""Age of a drive's newest sample after which the drive counts as lost [s], where the controller counts samples.

A controller may sample a drive more slowly than the host polls it.
"""

PATIENCE_S = 0.3
"""Time-out for a controller's nameplate [s].

It is several watchdogs, after which a previous host that has fallen silent has lost the controller.
"""

FAULTS, STATUSES = sum(DriveFault), sum(DriveFlag)
"""Bits that this version knows."""
STEP = len(STATE_JOINT)


class UdpNode(Node):
    """Drive of one joint, as its controller reports it; the controller keeps the noted faults."""

    def __init__(self, drive: Drive):
        super().__init__(drive, 1)
        self.current, self.fault = math.nan, DriveFault.LOST
        self.counts_samples, self.sample, self.sampled_at = False, -1, -math.inf
        """Whether the controller counts samples of this drive; the newest sample, and when it came first [s]."""

    @property
    def is_on(self) -> bool:
        """True if the drive gives the commanded torque."""
        return self.is_wanted

    def take(self, said: tuple[Any, ...], t: float) -> None:
        """Store the part of a controller's state that belongs to this drive.

        If the controller has no contact with the drive, the last valid position is kept and the current is set to zero.
        A drive whose newest sample is too old is lost.

        Args:
            said: Fields of the drive in the state.
            t: Time of the poll that the state answers [s].
        """
        self._misses, self.code, self.temperature_C = 0, said[CODE], said[TEMPERATURE]
        self.is_wanted, self.fault = _bits(said[STATUS] & STATUSES, said[FAULT] & FAULTS)
        if said[STATUS] & PRESENT:
            self.position, self.motor_position, self.current = said[POSITION], said[MOTOR_POSITION], said[CURRENT]
            if said[SAMPLES] != self.sample:
                self.sample, self.sampled_at = said[SAMPLES], t
            elif self.counts_samples and t - self.sampled_at > STALE_S:
                self.fault, self.is_wanted = self.fault | DriveFault.LOST, False
        else:
            self.current = 0.0

    def miss(self, is_lost: bool) -> None:
        """Note that no state has arrived in this tick; `is_lost` is True if the last state is too old."""
        self._misses = 1
        if is_lost:
            self.hold_against(DriveFault.LOST)


class UdpRig(Driver[UdpNode]):
    """Driver whose `read` polls the controller and waits for its answer.

    `write` sends current and damping of each drive.
    """

    answer_share: ClassVar[float] = 0.4

    def __init__(self, drives: Drives, answer_s: float | None = None, lock_step: bool = False, first_sequence: int = 0):
        """Send nothing before `with`; arguments as `Driver`.

        Args:
            drives: Drives of the machine.
            answer_s: Longest time for which `read` waits for the controller [s].
            lock_step: True if time is counted in periods.
            first_sequence: First sequence of our packets; tests start close to the wrap.

        Raises:
            ConfigError: The drives are on another bus.
        """
        udp = drives.table(UdpBus)
        super().__init__(drives, [UdpNode(drive) for drive in drives.each], answer_s, lock_step)
        self._link = Link((udp.host, udp.port), len(drives.joints), first_sequence)
        self._no_current = (0.0,) * (2 * len(drives.joints))
        self._heard_at, self._taken = -math.inf, 0

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        self._is_on = False
        for _ in range(3):  # a packet may be lost; the watchdog acts if all are
            self._link.command(self._state.sequence, self.t, 0.0, Flag.NONE, self._no_current)

    @property
    def _is_open(self) -> bool:
        return True  # a datagram needs no connection; the link checks its use itself

    def _open(self) -> None:
        self._link.open()

    def _begin(self) -> None:
        """Shake hands with the controller, and wait for a first measurement."""
        plates = agreed_nameplates(self._link.hello(PATIENCE_S), self._drives)
        for node, plate in zip(self._nodes, plates, strict=True):
            node.counts_samples, node.sample = plate.counts_samples, -1
        ends = self.t + PATIENCE_S
        self._heard_at = -math.inf
        while self._heard_at == -math.inf:
            self.read()
            if self.t > ends:
                raise RigError(
                    f"The controller at {self._link.address[0]}:{self._link.address[1]} sends its nameplate, but does "
                    f"not answer a poll within {1e3 * self._answer_s:g} ms. Is it busy, or is the network? Counts: "
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
            node.take(answer.packet.joints[STEP * k : STEP * (k + 1)], answer.t)
        return Asked(answer.t, answer.tick)

    def _tell(self, command: Command, currents: list[float], damping: list[float]) -> None:
        told = tuple(chain.from_iterable(zip(currents, damping, strict=True)))
        flags, now = Flag.ENABLE if self._is_on else Flag.NONE, self.t
        life_s = min(command.valid_until - now, self._drives.watchdog_s)
        if life_s <= 0.0 or self._link.command(command.sequence, now, life_s, flags, told) is None:
            self._expired += 1

    def _refresh(self) -> None:
        self.read()
        if self.t - self._heard_at > self._drives.watchdog_s:  # the controller may have restarted
            self._begin()

    def _switch_on(self) -> None:
        ends = self.t + ENABLE_S
        # Retried: a computer that stalls for a watchdog's time in this sequence has switched nothing on.
        while not self._try_to_switch_on(ends) and self.t < ends:
            pass
        self._refuse_off()

    def _try_to_switch_on(self, ends: float) -> bool:
        """Switch off, acknowledge faults, switch on; return True if all is done before `ends` [s]."""
        return (
            self._tell_until(Flag.NONE, ends, lambda node: not node.is_on)
            and self._tell_until(Flag.ACKNOWLEDGE, ends, lambda node: not node.fault)
            and self._tell_until(Flag.ENABLE, ends, lambda node: node.is_on)
        )

    def _tell_until(self, flags: Flag, ends: float, is_done: Callable[[UdpNode], bool]) -> bool:
        """Command zero torque once per period until every drive meets `is_done`, or until `ends` [s].

        When drives are switched on, a new fault ends the wait.
        """
        first: list[int] = []

        def are_done() -> bool:
            # Only a state that was sent after the controller took one of these commands shows their effect.
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


@cache  # ten bits at most; making enumerations in every tick is slow
def _bits(status: int, fault: int) -> tuple[bool, DriveFault]:
    """Return True for a drive that is on, and its faults."""
    if not status & DriveFlag.PRESENT:
        return False, DriveFault(fault) | DriveFault.LOST
    return bool(status & DriveFlag.ENABLED), DriveFault(fault)

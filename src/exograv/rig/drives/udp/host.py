"""A machine behind a laboratory's own controller: our clock asks it once in every period, and what is late is lost."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.clock import ENDED, LOCK_STEP_S
from exograv.rig.drives.driver import Driver, Joints
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.units import Units
from exograv.signals import Command, JointState, TorqueSource

from .layout import STATE_JOINT, DriveFlag, Flag, is_newer
from .link import CODE, CURRENT, FAULT, MOTOR_POSITION, POSITION, STATUS, TEMPERATURE, Link, UdpAnswer
from .nameplate import refuse_other_controller

ANSWER_SHARE = 0.4
"""Of a period, in which the answer has to come."""

LOST_S = 0.005
"""Without any answer, all joints are lost: five periods, after the three that a guard bridges, and before the first
drive's watchdog [s]."""

PATIENCE_S = 0.3
"""For a controller that is asked who it is: several watchdogs, after which whoever had it before has let it go [s]."""

ENABLE_S = 1.0
FAULTS, STATUSES = sum(DriveFault), sum(DriveFlag)
"""Bits that we know."""
STEP = len(STATE_JOINT)


class UdpRig(Driver):
    """`read` polls the controller and waits for its answer, `write` sends it a current and a damping for each drive."""

    def __init__(
        self, drives: Drives, answer_share: float = ANSWER_SHARE, first_sequence: int = 0, lock_step: bool = False
    ):
        """Nothing is sent before `with`.

        Args:
            drives: Of the machine; with a controller as their bus.
            answer_share: Of a period, for which `read` waits.
            first_sequence: Of our packets; tests begin close to the wrap.
            lock_step: Whether time is counted in periods, each as long as it takes: simulated drives only.

        Raises:
            ConfigError: They have another bus.
        """
        udp = drives.settings.udp
        if udp is None:
            raise ConfigError("drives.toml names no controller: [udp] with host and port is missing. Add it there.")
        super().__init__(drives, lock_step)
        self._units = Units(drives)
        self._link = Link((udp.host, udp.port), len(drives.joints), first_sequence)
        self._wait_s = LOCK_STEP_S if lock_step else answer_share * drives.period_s
        self._is_on = False
        n = len(drives.joints)
        none = np.full(n, np.nan)
        none.flags.writeable = False
        self._state = JointState(0.0, -1, none, none, none, TorqueSource.CURRENT)
        self._no_torque, self._heard_at = none, -math.inf
        self._no_current = (0.0,) * (2 * n)
        self._statuses = (DriveStatus(False, DriveFault.LOST),) * n
        self._taken = 0

    @property
    def counts(self) -> Mapping[str, int]:
        """What was refused, lost, limited or too old to be sent."""
        own = {"limited": self._units.limited, "expired": self._expired}
        return {**self._link.counts, **{name: count for name, count in own.items() if count}}

    def read(self) -> JointState:
        """Begin a tick: ask, and wait for a share of the period; the same as before where nothing has come.

        A joint that its controller does not hear is `faulty`, and stands there where it was heard last. After `LOST_S`
        without an answer all are.
        """
        until = time.monotonic() + (0.0 if self._clock.nobody_answers else self._wait_s)
        t = self._clock.tick()
        self._link.poll(self._clock.ticks, t)
        answer = self._link.collect(self._clock.ticks, until)
        if answer is not None:
            self._heard_at = answer.t
            self._statuses = self._statuses_of(answer)
            self._taken = answer.packet.own[0]
            self._state = self._state_of(answer)
        elif self._clock.is_in_lock_step and not self._clock.nobody_answers:
            raise RigError(ENDED)
        elif t - self._heard_at > LOST_S and len(self._state.faulty) < len(self.joints):
            self._state = replace(self._state, faulty=tuple(range(len(self.joints))))
            lost = (replace(one, is_enabled=False, fault=one.fault | DriveFault.LOST) for one in self._statuses)
            self._statuses = tuple(lost)
        return self._state

    def enable(self) -> None:
        """Switch all motors on, at zero torque; faults that are over are acknowledged by it, and by nothing else.

        Raises:
            RigError: A drive stays off; says which, and why.
        """
        if self._is_on and all(one.is_enabled and not one.fault for one in self._statuses):
            return
        self._is_on = False
        self.read()
        if self.t - self._heard_at > self._drives.watchdog_s:  # restarted, perhaps
            self._begin_session()
        ends = self.t + ENABLE_S
        # More than once: a computer that stalls for a watchdog's time just then has switched nothing on.
        while not self._switch_on(ends):
            if self.t < ends:
                continue
            self.disable()
            off = [
                one.sentence(joint)
                for joint, one in zip(self.joints, self._statuses, strict=True)
                if one.fault or not one.is_enabled
            ]
            raise RigError(
                f"The motors are not switched on. {' '.join(off)} Put that right at the machine, then enable again."
            )
        self._is_on = True

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        self._is_on = False
        for _ in range(3):  # one may be lost; the watchdog is behind all of them
            self._link.command(self._state.sequence, self.t, 0.0, Flag.NONE, self._no_current)

    def status(self) -> tuple[DriveStatus, ...]:
        """What each drive said last, in the order of the joints."""
        return self._statuses

    def expect_silence(self) -> None:
        """For examiners in lock-step: nobody answers from now on, and time passes all the same."""
        self._clock.nobody_answers = True

    @property
    def _is_open(self) -> bool:
        return True  # a datagram needs no connection; the link refuses by itself

    def _open(self) -> None:
        self._link.open()

    def _begin(self) -> None:
        self._begin_session()

    def _leave(self) -> None:
        self.disable()

    def _close(self) -> None:
        self._link.close()

    def _within_limits(self, command: Command) -> Joints:
        return self._units.drive_currents(command)

    def _tell(self, command: Command, currents: Joints, damping: Joints) -> None:
        told = np.empty(2 * len(currents))
        told[0::2], told[1::2] = currents, damping
        flags, now = Flag.ENABLE if self._is_on else Flag.NONE, self.t
        life_s = min(command.valid_until - now, self._drives.watchdog_s)
        if life_s <= 0.0 or self._link.command(command.sequence, now, life_s, flags, tuple(told.tolist())) is None:
            self._expired += 1

    def _begin_session(self) -> None:
        """Shake hands, and wait for a first measurement."""
        refuse_other_controller(self._link.hello(PATIENCE_S), self._drives)
        ends = self.t + PATIENCE_S
        self._heard_at = -math.inf
        while self._heard_at == -math.inf:
            self.read()
            if self.t > ends:
                raise RigError(
                    f"The controller at {self._link.address[0]}:{self._link.address[1]} says who it is, and does not "
                    f"answer a poll within {1e3 * self._wait_s:g} ms. Is it busy, or the network? Counted: "
                    f"{dict(self.counts)}."
                )

    def _switch_on(self, ends: float) -> bool:
        """Off, faults acknowledged, on; whether all has been done until then [s]."""
        return (
            self._tell_until(Flag.NONE, ends, lambda one: not one.is_enabled)
            and self._tell_until(Flag.ACKNOWLEDGE, ends, lambda one: not one.fault)
            and self._tell_until(Flag.ENABLE, ends, lambda one: one.is_enabled)
        )

    def _tell_until(self, flags: Flag, ends: float, is_done: Callable[[DriveStatus], bool]) -> bool:
        """Ask for no torque, once in each period, until every drive has done it, or it is then [s].

        Where one that is to go on has a fault again, nothing more is waited for.
        """
        due, first = time.monotonic(), None
        while self.t < ends:
            state = self.read()
            # Only what was said after it took one of these commands tells what they did.
            if first is not None and not is_newer(first, self._taken) and all(map(is_done, self._statuses)):
                return True
            if first is not None and flags & Flag.ENABLE and any(one.fault for one in self._statuses):
                return False
            told = self._link.command(state.sequence, self.t, self._drives.watchdog_s, flags, self._no_current)
            first = told if first is None else first
            if self._clock.is_in_lock_step:
                continue
            due = max(due + self.period_s, time.monotonic() - self.period_s)
            time.sleep(max(due - time.monotonic(), 0.0))
        return False

    def _state_of(self, answer: UdpAnswer) -> JointState:
        said = np.array(answer.packet.joints)
        q = self._units.positions(said[POSITION::STEP])
        current = self._units.joint_currents(said[CURRENT::STEP])
        q_motor = self._units.motor_positions(said[MOTOR_POSITION::STEP])
        faulty = tuple(
            joint for joint, one in enumerate(self._statuses) if one.fault or (self._is_on and not one.is_enabled)
        )
        if faulty:
            self._keep_unheard(q, current, q_motor)
        return JointState(answer.t, answer.tick, q, current, self._no_torque, TorqueSource.CURRENT, q_motor, faulty)

    def _keep_unheard(self, q: Joints, current: Joints, q_motor: Joints | None) -> None:
        for joint, one in enumerate(self._statuses):
            if DriveFault.LOST in one.fault:
                q[joint], current[joint] = self._state.q[joint], 0.0
                if q_motor is not None and self._state.q_motor is not None:
                    q_motor[joint] = self._state.q_motor[joint]

    def _statuses_of(self, answer: UdpAnswer) -> tuple[DriveStatus, ...]:
        said, statuses = answer.packet.joints, []
        for k in range(0, len(said), STEP):
            is_enabled, fault = _bits(said[k + STATUS] & STATUSES, said[k + FAULT] & FAULTS)
            statuses.append(DriveStatus(is_enabled, fault, said[k + CODE], said[k + TEMPERATURE]))
        return tuple(statuses)


@cache  # of ten bits at most; enumerations are slow to make in every tick
def _bits(status: int, fault: int) -> tuple[bool, DriveFault]:
    """Whether a drive is on, and its faults."""
    if not status & DriveFlag.PRESENT:
        return False, DriveFault(fault) | DriveFault.LOST
    return bool(status & DriveFlag.ENABLED), DriveFault(fault)

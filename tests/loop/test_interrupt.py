"""Ctrl-C lets a real machine down softly first; a simulated machine may stop anywhere."""

import signal
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from exograv import motion
from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.interrupt import HeldInterrupt
from exograv.loop.pilot import Pilot
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason
from exograv.signals import Command, JointState, Reference, TorqueSource

DT, PRESSED_TICK = 0.001, 300
CARRIED = np.array([2.0, 1.0])


@dataclass
class Real:
    """Two joints that stand still, in a machine that counts as real."""

    joints: tuple[str, ...] = ("one", "two")
    period_s: float = DT
    ticks: int = 0
    commands: list[Command] = field(default_factory=list)

    @property
    def t(self) -> float:
        return self.ticks * DT

    def read(self) -> JointState:
        return JointState(
            self.t, self.ticks, np.array([0.3, 0.6]), np.zeros(2), np.full(2, np.nan), TorqueSource.CURRENT
        )

    def write(self, command: Command) -> None:
        self.commands.append(command)
        self.ticks += 1

    def __enter__(self) -> "Real":
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        pass


@dataclass
class Computed(Real):
    is_virtual: bool = True


class Carrying:
    tau_feedforward, closure_slope, clearance = np.zeros(2), 0.0, 1.0

    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        return CARRIED


@pytest.fixture(autouse=True)
def heard():
    """Handle Ctrl-C as in a terminal. A test run in the background would inherit a signal that is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(rig: Real) -> Pilot:
    envelope = Envelope(Limits(np.full(2, 20.0), np.full(2, 4.0)), DT)
    pilot = Pilot(rig, ActuatorGain(np.ones(2), np.full(2, 0.2)), envelope)

    def press(_moment: object) -> None:
        if rig.ticks == PRESSED_TICK:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        pilot.run(Carrying(), motion.hold(np.zeros(2), 1.0, DT), "Holding", press)
    return pilot


def test_a_real_machine_comes_down_softly_before_ctrl_c_ends_the_session():
    rig = Real()
    pilot = interrupted(rig)
    assert pilot.envelope.stop is StopReason.STOP_PRESSED
    after = np.array([command.tau for command in rig.commands[PRESSED_TICK:]])
    assert len(after) * DT > pilot.envelope.limits.descent_s
    assert np.abs(np.diff(after, axis=0)).max() < 0.2, "no step in the torque on the way down"
    assert np.abs(after[0] - CARRIED).max() < 0.2, "the descent begins at the carrying torque"
    assert np.abs(after[-1]).max() < 0.01


def test_a_machine_that_is_only_computed_ends_at_once():
    rig = Computed()
    interrupted(rig)
    assert len(rig.commands) <= PRESSED_TICK + 1


def test_ctrl_c_works_as_before_when_the_machine_is_not_commanded_any_more():
    before = signal.getsignal(signal.SIGINT)
    with HeldInterrupt(is_real=True) as held:
        signal.raise_signal(signal.SIGINT)
        assert held.has_come
    assert signal.getsignal(signal.SIGINT) is before

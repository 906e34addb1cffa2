"""Control process of the live loop, which answers each state from the guard."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.runtime.clock.host import loop_cpus
from exograv.runtime.clock.realtime import CONTROL_AWAKE_MAX_US, limit_awake, realtime
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.safety.guard import COMMAND_LIFE_S

from .exchange import Channels, answer_dtype, answered_to, state_dtype

POLL_S = 20e-6
"""Time between two looks into a mailbox [s]; the kernel adds some 60 µs."""

WAITS_S = 0.005
"""Time between two looks for the first state of the guard [s]."""

ASK_PARENT_EVERY = 200
"""Looks of an idle process between two checks whether the run is over."""


@runtime_checkable
class ControlInterface(Protocol):
    """Interface of control for its process."""

    def answer(self, state: np.void, row: np.ndarray) -> None:
        """Fill in the answer to a state; `sequence`, `valid_until` and `seen` are filled in already."""
        ...

    @property
    def mode_names(self) -> tuple[str, ...]:
        """Names of phases in the recording, by the number in `mode`."""
        ...


@runtime_checkable
class Prepared(ControlInterface, Protocol):
    """Control that prepares for the machine's posture before it has to answer within a tick."""

    def prepare(self, state: np.void) -> None:
        """Prepare for the posture in `state`, without a limit of time."""
        ...


@runtime_checkable
class WorksAfterwards(ControlInterface, Protocol):
    """Control with work that would delay an answer."""

    def afterwards(self) -> None:
        """Do the work; called after each answer, in the rest of the period."""
        ...


@dataclass(frozen=True)
class ControlJob:
    """Start arguments of a control process."""

    build: Callable[[], ControlInterface]
    channels: Channels


def control_process(job: ControlJob, parent: Connection) -> None:
    """Run the control process: answer each state, until the parent ends the run or is gone."""
    states = Mailbox(state_dtype(job.channels.joints), job.channels.states)
    answers = Mailbox(answer_dtype(job.channels.joints), job.channels.answers)
    try:
        control = job.build()
        with realtime(loop_cpus().control), contextlib.suppress(EOFError):
            seen = _prepare(control, states, parent) if isinstance(control, Prepared) else 0
            limit_awake(CONTROL_AWAKE_MAX_US)
            # `ready` is sent after the rights are taken. That takes a fifth of a second, and a guard that began earlier
            # would have no answer.
            parent.send("ready")
            _answer_all(control, states, answers, job.channels.joints, parent, seen)
    finally:
        states.close()
        answers.close()


def _prepare(control: Prepared, states: Mailbox, parent: Connection) -> int:
    """Wait for the first state of the guard and prepare for it; return its number, or 0 if the parent ends the run."""
    while (got := states.read()) is None:
        if parent.poll(WAITS_S):
            return 0
    control.prepare(got[1])
    return got[0]


def _answer_all(
    control: ControlInterface, states: Mailbox, answers: Mailbox, joints: int, parent: Connection, seen: int
) -> None:
    row, idle = np.zeros((), answer_dtype(joints)), 0
    afterwards = control.afterwards if isinstance(control, WorksAfterwards) else None
    while True:
        got = states.read()
        if got is None or got[0] == seen:
            idle += 1
            if idle >= ASK_PARENT_EVERY:
                idle = 0
                if parent.poll():
                    parent.recv()
                    return
            time.sleep(POLL_S)
            continue
        seen, idle = got[0], 0
        before, row["sequence"] = int(row["sequence"]), got[1]["sequence"]
        row["valid_until"] = got[1]["now"] + COMMAND_LIFE_S
        row["seen"] = answered_to(int(row["seen"]), int(row["sequence"]) - before)
        control.answer(got[1], row)
        answers.write(row)
        if afterwards is not None:
            afterwards()

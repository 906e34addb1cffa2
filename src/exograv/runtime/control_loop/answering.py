"""Control process of the live loop, which answers each state from the guard."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.runtime.clock.realtime import realtime
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.safety.guard import COMMAND_LIFE_S

from .exchange import Channels, answer_dtype, answered_to, state_dtype

POLL_S = 20e-6
"""Time between two looks into a mailbox [s]; the kernel adds some 60 µs."""

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
        with realtime(), contextlib.suppress(EOFError):
            # `ready` is sent after the rights are taken. That takes a fifth of a second, and a guard that began earlier
            # would have no answer.
            parent.send("ready")
            _answer_all(control, states, answers, job.channels.joints, parent)
    finally:
        states.close()
        answers.close()


def _answer_all(control: ControlInterface, states: Mailbox, answers: Mailbox, joints: int, parent: Connection) -> None:
    row, seen, idle = np.zeros((), answer_dtype(joints)), 0, 0
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

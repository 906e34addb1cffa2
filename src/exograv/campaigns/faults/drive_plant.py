"""Fault plant behind a driver: the driver runs in this process, simulated drives with the wearer in another one."""

import contextlib
import os
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import RigError
from exograv.options import Bus
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.rig import Rig
from exograv.rig.drives.opening import DrivenRig, open_drives
from exograv.rig.drives.settings import Drives, load_drives
from exograv.safety.guard import COMMAND_LIFE_S
from exograv.signals import Command, JointState

from .drive_process import (
    AwaitSteps,
    BenchLine,
    DriveReport,
    FeelGravity,
    ForgetTruth,
    PlacePerson,
    Push,
    ResetBench,
    ScaleMotorConstant,
    SlideCuff,
    serve,
)
from .fault_participants import load_participant
from .fault_plant import FaultParticipant, FaultPlant, FlightStart, Joints, TruthSample

ANSWERS_S, STARTS_S = 30.0, 120.0
"""Time-outs for an answer of the other process and for its start [s]."""

STEP_MS = 1
"""Step of the twin [ms]."""


class DrivePlant:
    """Plant of one flight on simulated drives.

    Measurements and commands use the bus. Fault commands of the examiner and the twin's truth use a separate pipe.
    """

    def __init__(self, rig: DrivenRig, drives: Drives, line: "DriverLine"):
        self._rig, self._drives, self._line = rig, drives, line
        self._stride = drives.settings.period_ms // STEP_MS
        self._ticks, self._nobody_answers = 0, False
        self._state: JointState | None = None

    @property
    def t(self) -> float:
        """Time on the rig's clock [s]."""
        return self._rig.t

    @property
    def period_s(self) -> float:
        """Period of the loop [s]."""
        return self._rig.period_s

    @property
    def rig(self) -> Rig | None:
        """None: every tick crosses the bus."""
        return None

    def begin(self) -> None:
        """Do nothing: the process of the drives looks and moves the wearer at every step."""

    def read(self) -> JointState:
        """Query the drives, which advances them by one period."""
        self._ticks += 1
        if self._nobody_answers:  # The bus cannot tell then when the drives have finished their steps.
            self._line.send(AwaitSteps(self._ticks * self._stride))
            self._state = self._rig.read()
            self._line.answer()
        else:
            self._state = self._rig.read()
        return self._state

    def write(self, command: Command) -> None:
        """Send the command to the drives."""
        self._rig.write(command)

    def go_on(self, last: Command) -> None:
        """End the tick without a command. The next `read` advances the drives' time and sends no command."""

    def sights(self) -> list[TruthSample]:
        """Return one truth sample per tick, with the fastest hand speed within the tick."""
        return by_tick(self._line.ask(DriveReport()), self._stride)

    def forget(self) -> None:
        """Forget the truth of past steps."""
        self._line.ask(ForgetTruth())

    @property
    def q(self) -> Joints:
        """Position as measured last [rad]."""
        state = self._state if self._state is not None else self.read()
        return state.q

    def push(self, joint: int, torque: float) -> None:
        """Add a torque of the wearer's muscles [N·m]."""
        self._line.ask(Push(joint, torque))

    def hang(self, mount: str, mass_kg: float) -> None:
        """Attach a weight through the bench of the simulated drives."""
        self._line.ask(BenchLine(f"hang {mount} {mass_kg:g}"))

    def turn_motor(self, joint: int, factor: float) -> None:
        """Scale a motor's torque constant. Its drive does not know of the change."""
        self._line.ask(ScaleMotorConstant(joint, factor))

    def feel_gravity(self, g: Float[np.ndarray, " 3"]) -> None:
        """Turn gravity, as a tilted base does."""
        self._line.ask(FeelGravity(g))

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Slide the cuff along the limb."""
        self._line.ask(SlideCuff(name, along_m))

    def at_bench(self, word: str, joint: int | None = None, number: float | None = None) -> None:
        """Send a command to the bench of the simulated drives."""
        words = [word]
        words += [] if joint is None else [self._drives.joints[joint]]
        words += [] if number is None else [f"{number:g}"]
        self._line.ask(BenchLine(" ".join(words)))

    def is_silent(self) -> None:
        """Stop waiting for answers of the drives."""
        self._nobody_answers = True
        self._rig.expect_silence()


def by_tick(each: Sequence[TruthSample], stride: int) -> list[TruthSample]:
    """Reduce samples before the first step and after each step to one per tick, with the fastest hand in that tick."""
    ends = range(stride, len(each), stride)
    fastest = (max(one.hand_m_s for one in each[end - stride + 1 : end + 1]) for end in ends)
    return [each[end]._replace(hand_m_s=hand) for end, hand in zip(ends, fastest, strict=True)]


class DriverLine:
    """Pipe to the process of the simulated drives."""

    def __init__(self, ours: Connection):
        self._ours = ours

    def ask(self, what: Any) -> Any:
        """Send a request and return its answer."""
        self.send(what)
        return self.answer()

    def send(self, what: Any) -> None:
        """Send a request without waiting for the answer."""
        try:
            self._ours.send(what)
        except OSError as error:
            raise RigError(ENDED) from error

    def answer(self, within_s: float = ANSWERS_S) -> Any:
        """Return the answer to the oldest request.

        Raises:
            RigError: No answer came in time, or the process has ended.
        """
        try:
            if self._ours.poll(within_s):
                return self._ours.recv()
        except (EOFError, OSError) as error:
            raise RigError(ENDED) from error
        raise RigError(f"The simulated drives have not answered for {within_s:g} s. See their messages above.")


ENDED = "The process of the simulated drives has ended; see its messages above."


class DrivePlants:
    """Plants of a participant's machine behind simulated drives on one bus."""

    def __init__(self, bus: Bus, drives: Drives, line: DriverLine):
        self.bus: str | None = bus
        self.period_ms = drives.settings.period_ms
        self._drives, self._line = drives, line

    @contextlib.contextmanager
    def stand(self, participant: FaultParticipant, start: FlightStart) -> Iterator[FaultPlant]:
        """Enable the drives with the torque that carries the arm, then attach the person to the machine."""
        self._line.ask(ResetBench(start))
        prepared = participant.prepared
        tau = participant.controller.again(prepared.x).torque_at_rest(start.posture, prepared.x)
        current, still = prepared.machine.actuators.current(tau), np.zeros_like(tau)
        with open_drives(self._drives, lock_step=True) as rig:
            rig.enable()
            state = rig.read()
            rig.write(Command(rig.t, state.sequence, rig.t + COMMAND_LIFE_S, tau, current, still))
            rig.read()
            self._line.ask(PlacePerson())
            yield DrivePlant(rig, self._drives, self._line)


@contextlib.contextmanager
def driven_ground(bus: Bus, known: Path) -> Iterator[tuple[FaultParticipant, DrivePlants]]:
    """Start the process of the simulated drives, and end it afterwards.

    Args:
        bus: Bus of the drives.
        known: File of the participant (`fault_participants.prepare_participant`).

    Raises:
        RigError: The process does not start.
    """
    folder = known.parent / f"{known.stem}_{bus}_{os.getpid()}"
    description = load_participant(known).laboratory.description
    path = written(folder, description, bus)
    drives = load_drives(path, description)
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(known, path, bus, theirs), daemon=True)
    process.start()
    theirs.close()
    line = DriverLine(ours)
    try:
        line.answer(STARTS_S)
        yield load_participant(known, drives.settings.period_ms), DrivePlants(bus, drives, line)
    finally:
        ours.close()
        process.join(5.0)
        if process.is_alive():
            process.kill()
            process.join()

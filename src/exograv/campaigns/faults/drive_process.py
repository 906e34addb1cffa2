"""Process of the simulated drives in a flight through a driver, with the wearer and the examiner of the truth.

The truth leaves this process only after a flight and through a pipe of its own, so that no controller can use it.
"""

import pickle
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from exograv.laboratory.simulated_drives.drive_sim import front_end
from exograv.options import Bus
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated import Plant
from exograv.rig.drives.simulated.bench import SimulatedBench
from exograv.rig.drives.simulated.devices import SimulatedDevices
from exograv.rig.drives.simulated.firmware import AMBIENT_C
from exograv.rig.twin import Twin

from .fault_plant import FlightStart, SwayingWearer, TruthSample, twin_of


class ResetBench(NamedTuple):
    """Request: plug in all cables, cool all motors, and prepare the next wearer."""

    start: FlightStart


class PlacePerson(NamedTuple):
    """Request: place the person into the machine, in the posture in which it was held so far."""


class Push(NamedTuple):
    """Request: add a torque of the person's own muscles [N·m]."""

    joint: int
    torque: float


class ScaleMotorConstant(NamedTuple):
    """Request: multiply a motor's torque constant by a factor."""

    joint: int
    factor: float


class FeelGravity(NamedTuple):
    """Request: let the machine feel this specific force along the axes of a level base [-]."""

    g: Float[np.ndarray, " 3"]


class SlideCuff(NamedTuple):
    """Request: slide a cuff along the limb, away from where it was fastened [m]."""

    name: str
    along_m: float


class BenchLine(NamedTuple):
    """Request: carry out a line at the bench."""

    line: str


class AwaitSteps(NamedTuple):
    """Request: answer after this number of plant steps since the start."""

    steps: int


class ForgetTruth(NamedTuple):
    """Request: forget the truth of past steps."""


class DriveReport(NamedTuple):
    """Request: return the truth before the first step and after each step."""


class DriveExaminer:
    """Executor of the campaign's requests between two steps."""

    def __init__(self, known: Path, plant: Plant, device: SimulatedDevices, joints: tuple[str, ...], line: Connection):
        self._laboratory, prepared, *_ = pickle.loads(known.read_bytes())
        self._t0, self._plant, self._device, self._line = prepared.t, plant, device, line
        self._bench = SimulatedBench(joints, plant, device, lambda _: None)
        self._joints, self._next, self._awaited = joints, None, 0
        self._person: SwayingWearer | None = None
        self._sights: list[TruthSample] = []

    def obey(self) -> bool:
        """Carry out the waiting requests. Return True if the process is to end."""
        if self._awaited and len(self._sights) > self._awaited:
            self._awaited = 0
            self._line.send(None)
        try:
            while self._line.poll():
                if not self._do(self._line.recv()):
                    return True
        except (EOFError, OSError):  # The campaign's process has ended.
            return True
        return False

    def _do(self, asked: Any) -> bool:
        """Carry out one request. Return False if the process is to end."""
        if asked is None:
            return False
        if isinstance(asked, AwaitSteps):
            self._awaited = asked.steps
            return True
        acts: dict[type, Callable[[Any], Any]] = {
            ResetBench: lambda it: self._tidy(it.start),
            PlacePerson: lambda _: self._begin(),
            Push: lambda it: self._push(it.joint, it.torque),
            ScaleMotorConstant: lambda it: self._plant.turn_motor(it.joint, it.factor),
            FeelGravity: lambda it: self._twin.fly(it.g),
            SlideCuff: lambda it: self._twin.slide_cuff(it.name, it.along_m),
            BenchLine: lambda it: self._bench.do(it.line),
            ForgetTruth: lambda _: self._sights.clear(),
            DriveReport: lambda _: self._sights,
        }
        self._line.send(acts[type(asked)](asked))
        return True

    def _tidy(self, start: FlightStart) -> None:
        self._plant.watch, self._sights = None, []
        self._device.mend()
        self._plant.release_stop()
        for joint, drive in enumerate(self._plant.each):
            self._device.plug(joint)
            drive.temperature_C = AMBIENT_C
        self._next = SwayingWearer(twin_of(self._laboratory, start, self._t0), start)

    def _begin(self) -> None:
        person = self._person = self._next
        assert person is not None
        self._plant.change(person.twin)
        self._plant.watch = self._look_on
        self._look_on()

    def _look_on(self) -> None:
        if self._person is not None:
            self._sights.append(self._person.look())
            self._person.sway()

    @property
    def _twin(self) -> Twin:
        assert self._person is not None
        return self._person.twin

    def _push(self, joint: int, torque: float) -> None:
        self._plant.twin.tau_voluntary[joint] += torque


def serve(known: Path, drives_file: Path, bus: Bus, line: Connection) -> None:
    """Serve simulated drives until the campaign ends them; `known` is the file of a participant."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # The process that started this one also ends it.
    laboratory, prepared, *_ = pickle.loads(known.read_bytes())
    description = laboratory.description
    drives = load_drives(drives_file, description)
    start = FlightStart(0, description.donning_posture, 0.0 * description.donning_posture)
    plant = Plant(twin_of(laboratory, start, prepared.t), drives)
    with front_end(bus, drives)(plant, drives, lock_step=True, say=lambda _: None) as device:
        line.send(None)
        device.run(DriveExaminer(known, plant, device, drives.joints, line).obey)

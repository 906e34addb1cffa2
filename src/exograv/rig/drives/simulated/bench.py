"""Actions of an operator at the bench of simulated drives, on any bus: hang weights, pull cables, press the stop."""

import json
import os
import queue
import select
import threading
from collections.abc import Callable, Iterable

import numpy as np

from exograv.errors import ExogravError, RigError
from exograv.rig.drive_status import DriveFault

from .devices import SimulatedDevices
from .plant import InstructedWearer, Plant

HELP = """\
hang MOUNT KG   hang a weight at a mount of the machine; 0 removes it
turn JOINT NM   turn a joint by hand with this torque; 0 lets go
unplug JOINT    disconnect this drive from the bus; plug JOINT: connect it again
cut             disconnect the cable to the host; mend: connect it again
freeze JOINT    let this drive repeat its last sample, while its motor goes on; thaw JOINT: new samples again
fail JOINT      internal fault of this drive
heat JOINT C    set the temperature of its winding
mode NAME       tell the wearer that this mode of the machine begins, such as ramp_in
rest S LEVEL    tell a weak person to go to rest within S seconds, at this gravity level
attempt         tell a weak person to get ready; reach N X Y Z: reach for target N at this place in metres
therapist       let a therapist move the arm along a path and hold it at the end; lead SIDE: move one of two arms
press           hardware stop: every drive is off and brakes; release: close its line again
report          state of each drive by its own report, as JSON
quit            end"""


class SimulatedBench:
    """Bench whose lines come from a thread. They are executed between two steps, so that typing delays no drive."""

    def __init__(
        self,
        joints: tuple[str, ...],
        plant: Plant,
        front: SimulatedDevices,
        say: Callable[[str], None],
        ends_with_input: bool = False,
    ):
        """Take no lines yet.

        Args:
            joints: Joints of the machine.
            plant: Motors and twin.
            front: Drives at their bus.
            say: Function that shows a line.
            ends_with_input: True if the end of the input ends the simulation, because its owner has ended.
        """
        self._joints, self._plant, self._front, self._say = joints, plant, front, say
        self._ends_with_input = ends_with_input
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._descriptor: int | None = None
        self._begun = b""
        self.is_done = False

    def listen(self, lines: Iterable[str]) -> None:
        """Read lines from now on, until they end."""

        def read() -> None:
            for line in lines:
                self._lines.put(line)
            self._input_ended()

        threading.Thread(target=read, daemon=True).start()

    def watch(self, descriptor: int) -> None:
        """Read lines from a descriptor between two steps, without a thread.

        A thread of usual priority that holds the interpreter's lock would delay the real-time thread of the drives.
        """
        self._descriptor = descriptor

    def _look(self) -> None:
        """Take the lines that have arrived at the descriptor."""
        if self._descriptor is None or not select.select([self._descriptor], [], [], 0.0)[0]:
            return
        data = os.read(self._descriptor, 4096)
        if not data:
            self._descriptor = None
            self._input_ended()
        *lines, self._begun = (self._begun + data).split(b"\n")
        for line in lines:
            self._lines.put(line.decode(errors="replace"))

    def _input_ended(self) -> None:
        if self._ends_with_input:
            self._lines.put("quit")

    def obey(self) -> bool:
        """Execute the lines that have been typed; return True if the simulation shall end."""
        self._look()
        while not self._lines.empty():
            line = self._lines.get()
            try:
                self.do(line)
            except ExogravError as error:
                self._say(f"not done: {error}")
        return self.is_done

    def do(self, line: str) -> None:
        """Execute one command line of the bench, such as `hang elbow 1.5`.

        Raises:
            RigError: The word, joint, mount or number is not valid.
        """
        word, *rest = line.split() or [""]
        acts: dict[str, Callable[..., None]] = {
            "help": lambda: self._say(HELP),
            "hang": lambda mount, kg: self._plant.twin.hang(mount, _number(kg)),
            "turn": self._turn,
            "unplug": lambda joint: self._front.unplug(self._joint(joint)),
            "plug": lambda joint: self._front.plug(self._joint(joint)),
            "cut": self._front.cut,
            "mend": self._front.mend,
            "freeze": lambda joint: self._plant.freeze(self._joint(joint)),
            "thaw": lambda joint: self._plant.thaw(self._joint(joint)),
            "fail": lambda joint: self._plant.each[self._joint(joint)].fail(DriveFault.INTERNAL),
            "heat": self._heat,
            "mode": self._plant.hear,
            "rest": lambda seconds, level: self._person.rest(_number(seconds), _number(level)),
            "attempt": self._attempt,
            "reach": self._reach,
            "therapist": self._begin_therapy,
            "lead": self._begin_therapy,
            "press": self._plant.press_stop,
            "release": self._plant.release_stop,
            "report": lambda: self._say(self.report()),
            "quit": self._end,
        }
        if not word:
            return
        if word not in acts or len(rest) != _WORDS_AFTER.get(word, 0):
            raise RigError(f"'{line.strip()}' is not a command. Commands:\n{HELP}")
        acts[word](*rest)
        if word not in ("help", "report"):
            self._say(f"{self._plant.now:.3f} s: done: {line.strip()}")

    def report(self) -> str:
        """Report of each drive as JSON: enabled or not, faults, and its output to the motor."""
        drives = zip(self._joints, self._plant.each, self._plant.outputs, strict=True)
        joints = {
            joint: {
                "enabled": drive.is_enabled,
                "fault": [one.name for one in drive.fault],
                "current_A": output.current,
                "damping": output.damping,
                "temperature_C": round(drive.temperature_C, 2),
            }
            for joint, drive, output in drives
        }
        return json.dumps({"t": round(self._plant.now, 6), "joints": joints})

    def _heat(self, joint: str, celsius: str) -> None:
        self._plant.each[self._joint(joint)].temperature_C = _number(celsius)

    def _turn(self, joint: str, torque: str) -> None:
        self._plant.twin.tau_hand[self._joint(joint)] = _number(torque)

    def _attempt(self) -> None:
        self._person.attempt()

    def _reach(self, target: str, *place: str) -> None:
        self._person.reach(round(_number(target)), np.array([_number(one) for one in place]))

    def _begin_therapy(self, side: str | None = None) -> None:
        if self._plant.therapist is None:
            raise RigError("No therapist moves an arm here. Start with --worn and without --person.")
        self._plant.therapist(side)

    @property
    def _person(self) -> InstructedWearer:
        if self._plant.person is None:
            raise RigError("No person in the machine follows instructions. Start with --worn --person weak.")
        return self._plant.person

    def _end(self) -> None:
        self.is_done = True

    def _joint(self, name: str) -> int:
        if name not in self._joints:
            raise RigError(f"No joint '{name}'. Joints: {', '.join(self._joints)}.")
        return self._joints.index(name)


_WORDS_AFTER = {
    "hang": 2,
    "turn": 2,
    "heat": 2,
    "mode": 1,
    "lead": 1,
    "rest": 2,
    "reach": 4,
    "unplug": 1,
    "plug": 1,
    "freeze": 1,
    "thaw": 1,
    "fail": 1,
}


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise RigError(f"'{text}' is not a number.") from error
    if not abs(value) < 1e4:
        raise RigError(f"'{text}' is not between -10000 and 10000.")
    return value

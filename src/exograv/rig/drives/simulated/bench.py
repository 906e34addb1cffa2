"""What somebody does at the bench beside simulated drives: hangs weights, pulls cables, presses the stop; any bus."""

import json
import queue
import threading
from collections.abc import Callable, Iterable

from exograv.errors import ExogravError, RigError
from exograv.rig.drive_status import DriveFault

from .devices import SimulatedDevices
from .plant import Plant

HELP = """\
hang MOUNT KG   hang a weight at a mount of the machine; 0 takes it off
turn JOINT NM   turn a joint by hand with this torque; 0 lets go
unplug JOINT    this drive is not heard any more, and hears nothing; plug JOINT: again
cut             the cable to the host is out; mend: in again
fail JOINT      an internal fault of this drive
heat JOINT C    its winding has this temperature
press           the hardware stop: every drive is off and brakes; release: its line is closed again
report          what each drive does, by its own account, as JSON
quit            end"""


class SimulatedBench:
    """Lines come from a thread, and are obeyed between two steps: whoever types disturbs no drive's time."""

    def __init__(self, joints: tuple[str, ...], plant: Plant, front: SimulatedDevices, say: Callable[[str], None]):
        self._joints, self._plant, self._front, self._say = joints, plant, front, say
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.is_done = False

    def listen(self, lines: Iterable[str]) -> None:
        """Read lines from now on, until they end."""

        def read() -> None:
            for line in lines:
                self._lines.put(line)

        threading.Thread(target=read, daemon=True).start()

    def obey(self) -> bool:
        """Do what has been typed; whether to end."""
        while not self._lines.empty():
            line = self._lines.get()
            try:
                self.do(line)
            except ExogravError as error:
                self._say(f"not done: {error}")
        return self.is_done

    def do(self, line: str) -> None:
        """One line.

        Raises:
            RigError: No such word, joint, mount or number.
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
            "fail": lambda joint: self._plant.each[self._joint(joint)].fail(DriveFault.INTERNAL),
            "heat": self._heat,
            "press": self._plant.press_stop,
            "release": self._plant.release_stop,
            "report": lambda: self._say(self.report()),
            "quit": self._end,
        }
        if not word:
            return
        if word not in acts or len(rest) != _WORDS_AFTER.get(word, 0):
            raise RigError(f"'{line.strip()}' is not understood. What can be done here:\n{HELP}")
        acts[word](*rest)
        if word not in ("help", "report"):
            self._say(f"{self._plant.now:.3f} s: done: {line.strip()}")

    def report(self) -> str:
        """Of each drive: on or not, faults, and what it does to its motor."""
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

    def _end(self) -> None:
        self.is_done = True

    def _joint(self, name: str) -> int:
        if name not in self._joints:
            raise RigError(f"There is no joint '{name}'. The joints are {', '.join(self._joints)}.")
        return self._joints.index(name)


_WORDS_AFTER = {"hang": 2, "turn": 2, "heat": 2, "unplug": 1, "plug": 1, "fail": 1}


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise RigError(f"'{text}' is no number.") from error
    if not abs(value) < 1e4:
        raise RigError(f"'{text}' is not between -10000 and 10000.")
    return value

"""From a silent bus to drives that give torque: look who is there, check each, then switch all on together."""

import time
from collections.abc import Callable, Sequence

from moteus import Register

from exograv.errors import RigError
from exograv.rig.drives.settings import Drives

from .cycle import MoteusCycle
from .diagnostic import Diagnostic
from .fdcanusb import CanFdFrame, Fdcanusb
from .modes import POWERLESS
from .nameplate import read_plate
from .node import MoteusNode

LISTEN_S = 0.1
"""Before anything is said: a master cycles in milliseconds."""

ENABLE_S = 1.0
"""In which all drives have to be on."""


def refuse_others(cycle: MoteusCycle) -> None:
    """Whether nobody else is heard.

    Raises:
        RigError: Somebody is.
    """

    def refuse(frame: CanFdFrame) -> None:
        raise RigError(
            f"Another host commands on this bus: frame 0x{frame.arbitration_id:04x} was heard before anything was "
            "said. End that program (or tview) first; two masters would take turns with the motors."
        )

    cycle.listen(LISTEN_S, refuse)


def set_up(nodes: Sequence[MoteusNode], drives: Drives, link: Fdcanusb, source: int) -> None:
    """Read and check the settings of these; none is switched on.

    Raises:
        RigError: One does not answer, or is on already though nobody commands it.
        ConfigError: One is not set to what `drives.toml` says, or to what exograv needs.
    """
    for node in nodes:
        asked = Diagnostic(link, node.drive.joint, node.drive.node, source)
        node.set_up(read_plate(asked, node.drive, drives), source, drives.watchdog_s)
        mode = asked.register(Register.MODE, is_short=True)
        if mode not in POWERLESS:
            raise RigError(
                f"The moteus of {node.drive.joint} (id {node.drive.node}) is on already, in mode {mode}, and nobody "
                f"commands it. Switch it off: moteus_tool -t {node.drive.node} --stop; then begin again."
            )


def enable_all(nodes: Sequence[MoteusNode], cycle: MoteusCycle, read: Callable[[], object], period_s: float) -> None:
    """Lead every drive to torque, at none, one order a period.

    Args:
        nodes: Of all joints.
        cycle: To tell them by.
        read: A question and its answers.
        period_s: Of the loop; 0 if it takes as long as it takes [s].

    Raises:
        RigError: A drive is not on after `ENABLE_S`, or its fault is not over.
    """
    for node in nodes:
        node.begin_waking()
    due, ends = time.monotonic(), time.monotonic() + ENABLE_S
    try:
        while time.monotonic() < ends:
            read()
            if any(node.has_failed for node in nodes) or all(node.is_on and node.has_answered for node in nodes):
                break
            cycle.tell([node.wake() for node in nodes])
            due = max(due + period_s, time.monotonic() - period_s)
            time.sleep(max(due - time.monotonic(), 0.0))
    finally:
        for node in nodes:
            node.end_waking()
    off = [node for node in nodes if node.fault or not node.is_on]
    if off:
        why = " ".join(_why_off(node) for node in off)
        raise RigError(f"The motors are not switched on. {why} Put that right at the machine, then enable again.")


def _why_off(node: MoteusNode) -> str:
    if node.fault:
        return node.status.sentence(node.drive.joint)
    return f"The moteus of {node.drive.joint} (id {node.drive.node}) stays in mode {node.said.mode}."

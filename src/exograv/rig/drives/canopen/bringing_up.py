"""From a silent bus to drives that give torque: look who is there, set each drive up, then switch all on together."""

import time
from collections.abc import Callable, Sequence

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives

from .bus import Bus
from .configuration import configure
from .cycle import CanopenCycle, masters_frames
from .emergency import fault_of
from .network import asking
from .node import CanopenNode
from .objects import Nmt
from .states import ENABLE, Cia402State, next_control

LISTEN_S = 0.1
"""Before anything is said: a master cycles in milliseconds."""

START_S = 0.3
"""In which each drive has to answer a SYNC after its start."""

ENABLE_S = 1.0
"""In which all drives have to be on."""


def set_up(
    drives: Drives, bus: Bus, cycle: CanopenCycle, nodes: Sequence[CanopenNode], answer_s: float, first: bool = False
) -> tuple[str, ...]:
    """Check and configure these drives, start their frames, and see that they answer; none is enabled.

    Args:
        drives: Of the whole machine.
        bus: Nobody else reads it meanwhile.
        cycle: Of all drives.
        nodes: The ones to set up.
        answer_s: For which a SYNC's answers are waited for at most [s].
        first: Whether we have said nothing on this bus yet, so that any other master is heard.

    Returns:
        What the drives cannot that others can, in sentences.

    Raises:
        RigError: One does not answer, or cannot what is needed; or somebody else commands.
        ConfigError: One is not what `drives.toml` says.
    """
    if first:
        _refuse_other_master(drives, bus)
    cycle.order(Nmt.PRE_OPERATIONAL, nodes)
    notes: tuple[str, ...] = ()
    with asking(bus, tuple(node.drive for node in nodes)) as asked:
        for node in nodes:
            found = configure(drives, node.drive, asked[node.drive.joint])
            node.has_damping, node.rated_torque_Nm = found.has_damping, found.rated_torque_Nm
            if found.error_code:
                node.hold_against(fault_of(found.error_code), found.error_code)
            notes += found.notes
    for node in nodes:
        node.start()
    cycle.listen()
    cycle.order(Nmt.START, nodes)
    _await_answers(cycle, nodes, answer_s)
    return notes


def enable_all(
    nodes: Sequence[CanopenNode],
    period_s: float,
    now: Callable[[], float],
    read: Callable[[], object],
    tell: Callable[[], None],
) -> None:
    """Lead every drive through its states, one step a period, at zero torque.

    Args:
        nodes: Of all joints.
        period_s: Of the loop [s].
        now: The rig's clock [s].
        read: A SYNC and its answers.
        tell: Sends each drive its control word and no torque.

    Raises:
        RigError: A drive is not on after `ENABLE_S`, or somebody else commands.
    """
    for node in nodes:
        node.forgive()
    begun, period = now(), 0
    while now() < begun + ENABLE_S:
        read()
        if all(node.state is Cia402State.OPERATION_ENABLED and node.control == ENABLE for node in nodes):
            break
        for node in nodes:
            node.control = next_control(node.state, node.control)
        tell()
        period += 1
        time.sleep(max(begun + period * period_s - now(), 0.0))
    off = [node for node in nodes if node.fault or node.state is not Cia402State.OPERATION_ENABLED]
    if off:
        raise RigError(" ".join(_why_off(node) for node in off) + " Nothing is enabled.")
    for node in nodes:
        node.is_wanted = True


def _why_off(node: CanopenNode) -> str:
    joint, status = node.drive.joint, node.status
    if status.fault:
        return status.sentence(joint)
    return f"The drive of {joint} (node {node.drive.node}) stays {node.state.value}: look at its own display or tool."


def _refuse_other_master(drives: Drives, bus: Bus) -> None:
    masters = masters_frames([drive.node for drive in drives.each])
    until = time.monotonic() + LISTEN_S
    while (frame := bus.receive(until - time.monotonic())) is not None:
        if frame.cob in masters:
            raise RigError(
                f"Somebody else commands on this bus: frame 0x{frame.cob:03X} was heard before anything was said. End "
                "the other program (or the drive maker's tool) first; two masters would take turns with the motors."
            )


def _await_answers(cycle: CanopenCycle, nodes: Sequence[CanopenNode], answer_s: float) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        cycle.ask(answer_s)
        if all(node.has_answered and not node.is_lost for node in nodes):
            return
        for node in nodes:
            node.start()
    silent = [node for node in nodes if not node.has_answered]
    if any(DriveFault.OTHER_MASTER in node.fault for node in nodes):
        raise RigError("Somebody else commands on this bus. End the other program first.")
    names = ", ".join(f"{node.drive.joint} (node {node.drive.node})" for node in silent)
    raise RigError(
        f"No measurement comes from {names} after its start, though it answers questions. Does the drive send its "
        "PDOs with SYNC (transmission type 1)? docs/canopen.md lists what it has to support."
    )

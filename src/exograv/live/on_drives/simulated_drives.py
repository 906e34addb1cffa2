"""A bring-up without hardware: simulated drives in another process, and hands that write to their bench."""

import contextlib
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from exograv.errors import RigError
from exograv.laboratory.virtual_laboratory import DAMPING
from exograv.model.description import RigDescription
from exograv.rig.drives.simulated.address import free_port

READY_MAX_S = 120.0
DONE_MAX_S = 10.0
GREETING, DONE = "Simulated drives of", "done: "
RATED_SHARE = 1.0 / 3.0  # of the greatest current, for ever: as in examples/drives


COUNTS_PER_TURN, GEAR = 2**20, 25
"""Of simulated CAN drives: encoders so fine that the twin's own are what is felt; their motors' turn so much faster."""


def drives_of(description: RigDescription, port: int, bus: str = "udp") -> str:
    """A `drives.toml` of simulated drives for any machine: what its motors may give, by their data sheets.

    Where they are reached no other machine that is simulated on this computer is: by `port`.
    """
    most = description.per_actuator("torque_max_Nm") / description.nominal_gain
    counts = f"counts_per_turn = {COUNTS_PER_TURN}\nmotor_counts_per_turn = {GEAR * COUNTS_PER_TURN}\n"
    drives = [
        f'[[drives]]\njoint = "{joint}"\nnode = {node}\ncurrent_rated_A = {RATED_SHARE * current:.4g}\n'
        f"current_max_A = {current:.4g}\nbrake_Nms_per_rad = {DAMPING[place]:g}\n"
        f"{counts if bus == 'canopen' else ''}"
        for node, (joint, current, place) in enumerate(
            zip(description.joints, most, description.places, strict=True), start=1
        )
    ]
    bus_table = _BUS[bus].format(port=port, folder=tempfile.gettempdir())
    head = (
        "# Simulated drives, written by exograv for `exograv drive-sim` and for whoever talks to it.\n"
        f'schema_version = 1\nrig = "{description.name}"\nserial = "simulated"\n{bus_table}\n'
    )
    return "\n".join([head, *drives])


_BUS = {
    "udp": "\n[udp]\nport = {port}",
    "canopen": 'period_ms = 2\n\n[canopen]\ninterface = "udp_multicast"\nchannel = "239.74.163.2:{port}"',
    "moteus": "period_ms = 2\n\n[moteus]\npath = '{folder}/exograv_fdcanusb_{port}'",
}


@contextlib.contextmanager
def simulated_drives(bus: str, options: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """`exograv drive-sim` in another process; what has a line done at its bench.

    Raises:
        RigError: It does not begin, or does not do what it is told; with what it has said.
    """
    command = [sys.executable, "-m", "exograv.cli", "drive-sim", bus, *options]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
    )
    assert process.stdin is not None
    assert process.stdout is not None
    said: queue.Queue[str] = queue.Queue()
    lines, keys = process.stdout, process.stdin
    reader = threading.Thread(target=lambda: [said.put(line) for line in lines], daemon=True)
    reader.start()
    try:
        _await(GREETING, process, said, READY_MAX_S)

        def tell(line: str) -> None:
            keys.write(f"{line}\n")
            keys.flush()
            _await(DONE, process, said, DONE_MAX_S)

        yield tell
    finally:
        with contextlib.suppress(OSError):
            keys.write("quit\n")
            keys.close()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join(1.0)
        lines.close()


def _await(words: str, process: "subprocess.Popen[str]", said: "queue.Queue[str]", most_s: float) -> None:
    heard, until = "", time.monotonic() + most_s
    while words not in heard:
        try:
            heard += said.get(timeout=0.2)
        except queue.Empty:
            if process.poll() is not None or time.monotonic() > until:
                raise RigError(
                    f"The simulated drives do not do what they are told. They said: {heard.strip() or 'nothing'}"
                ) from None


def written(folder: Path, description: RigDescription, bus: str = "udp") -> Path:
    """Such a file of this machine in a folder, with a port of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "drives.toml"
    path.write_text(drives_of(description, free_port(), bus), encoding="utf-8")
    return path

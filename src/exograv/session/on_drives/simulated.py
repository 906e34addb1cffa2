"""A bring-up without hardware: simulated drives in another process, and hands that write to their bench."""

import contextlib
import queue
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from exograv.errors import RigError
from exograv.model.description import RigDescription
from exograv.session.virtual import DAMPING

READY_MAX_S = 120.0
DONE_MAX_S = 10.0
GREETING, DONE = "Simulated drives of", "done: "
RATED_SHARE = 1.0 / 3.0  # of the greatest current, for ever: as in examples/drives


def drives_of(description: RigDescription, port: int) -> str:
    """A `drives.toml` of simulated drives for any machine: what its motors may give, by their data sheets."""
    most = description.per_actuator("torque_max_Nm") / description.nominal_gain
    drives = [
        f'[[drives]]\njoint = "{joint}"\nnode = {node}\ncurrent_rated_A = {RATED_SHARE * current:.4g}\n'
        f"current_max_A = {current:.4g}\nbrake_Nms_per_rad = {DAMPING[place]:g}\n"
        for node, (joint, current, place) in enumerate(
            zip(description.joints, most, description.places, strict=True), start=1
        )
    ]
    head = (
        "# Simulated drives, written by `exograv rig-test --simulate`.\n"
        f'schema_version = 1\nrig = "{description.name}"\nserial = "simulated"\n\n[udp]\nport = {port}\n'
    )
    return "\n".join([head, *drives])


def free_port() -> int:
    """That nobody listens on now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


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


def written(folder: Path, description: RigDescription) -> Path:
    """Such a file of this machine in a folder, with a port of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "drives.toml"
    path.write_text(drives_of(description, free_port()), encoding="utf-8")
    return path

"""Neighbours of a session in another process: a device that sends a stream of LSL, and a router of Zenoh for ROS 2."""

import contextlib
import importlib
import json
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

from exograv.errors import RigError
from exograv.rig.drives.simulated.address import free_port

STREAM = "process-faults"
"""Name of the device's stream."""

RATE_HZ = 100.0
READY = "The neighbours are ready."


@contextlib.contextmanager
def neighbours(needs_stream: bool, needs_router: bool) -> Iterator[str]:
    """Run the neighbours that a session needs; yield the locator of the router, or an empty text.

    Raises:
        RigError: They do not start.
    """
    if not needs_stream and not needs_router:
        yield ""
        return
    port = free_port() if needs_router else 0
    words = [sys.executable, "-m", __name__, str(int(needs_stream)), str(port)]
    pipe, joined = subprocess.PIPE, subprocess.STDOUT
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=joined, text=True, process_group=0) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            said = ""
            while READY not in said:
                if not (line := process.stdout.readline()):
                    raise RigError(f"The neighbours of the process faults do not start: {said.strip()}")
                said += line
            yield f"tcp/localhost:{port}" if needs_router else ""
        finally:
            process.kill()


def main(needs_stream: str, port: str) -> None:
    """Serve until killed, or until the campaign has ended."""
    with contextlib.ExitStack() as stack:
        if int(port):
            stack.enter_context(_router(int(port)))
        outlet = _outlet() if int(needs_stream) else None
        print(READY, flush=True)
        count = 0
        while not select.select([sys.stdin], [], [], 0.0)[0]:  # readable when the campaign has ended
            if outlet is not None:
                count += 1
                outlet.push_sample([float(count)])
            time.sleep(1.0 / RATE_HZ)


def _outlet() -> Any:
    pylsl = importlib.import_module("pylsl")
    return pylsl.StreamOutlet(pylsl.StreamInfo(STREAM, "Misc", 1, RATE_HZ, "float32", STREAM))


def _router(port: int) -> Any:
    zenoh = importlib.import_module("zenoh")
    settings = {
        "mode": "router",
        "listen": {"endpoints": [f"tcp/localhost:{port}"]},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {"shared_memory": {"enabled": False}},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


if __name__ == "__main__":
    main(*sys.argv[1:])

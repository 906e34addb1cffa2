"""A node of PyZeROS, which is not ours, reads our joint states and asks for a level.

PyZeROS is an implementation of ROS 2 by others, in Python (tests/peers_python.py).
"""

import contextlib
import json
import queue
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.peers_python import own_environment, peers_python
from tests.runtime.ros2.test_bridging import JOINTS, OLD_S, SOON_S, STAMP_NS, Peer, Run, peer, running

from exograv.runtime.control_loop.exchange import FeltLevel

pytest.importorskip("zenoh")
PYTHON = peers_python("pyzeros")

__all__ = ["peer"]  # The fixture: the router between the two nodes.


class ForeignNode:
    """Process with the foreign node."""

    def __init__(self, port: int):
        program = [PYTHON, str(Path(__file__).with_name("foreign_node.py")), str(port)]
        self._process = subprocess.Popen(
            program,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=own_environment(),
            cwd=tempfile.gettempdir(),  # it compiles its messages into the working directory
        )
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._reading = threading.Thread(target=self._read)
        self._reading.start()
        self.line("ready", lambda: None)

    def line(self, kind: str, meanwhile: Callable[[], object]) -> dict[str, Any]:
        """Return the next line with this key."""
        until = time.monotonic() + SOON_S
        while time.monotonic() < until:
            meanwhile()
            with contextlib.suppress(queue.Empty):
                found = self._lines.get(timeout=0.005)
                if kind in found:
                    return found
        raise AssertionError(f"no {kind}")

    def ask(self, level: float) -> None:
        assert self._process.stdin is not None
        print(level, file=self._process.stdin, flush=True)

    def close(self) -> None:
        self._process.kill()
        self._process.wait(SOON_S)
        self._reading.join(SOON_S)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(json.loads(line))


@pytest.fixture
def flown(tmp_path: Path, peer: Peer) -> Iterator[tuple[Run, ForeignNode]]:
    with contextlib.closing(ForeignNode(peer.port)) as node, running(tmp_path, peer, True) as run:
        yield run, node


def test_a_foreign_node_reads_the_joint_states_with_their_time(flown: tuple[Run, ForeignNode]):
    run, node = flown
    offset_ns = time.time_ns() - time.monotonic_ns()
    for _ in range(5):
        state = node.line("position", run.tick)
        row = run.put_in[round(state["position"][1])]
        assert state["name"] == list(JOINTS)
        assert state["position"] == row["q_measured"].tolist()
        assert (state["velocity"], state["effort"]) == ([0.5, -0.5], [3.0, -4.0])
        assert abs(state["stamp_ns"] - round(1e9 * (float(row["monotonic"]) - OLD_S)) - offset_ns) < STAMP_NS


def test_a_level_that_a_foreign_node_asks_for_is_passed_on_or_refused_with_a_reason(flown: tuple[Run, ForeignNode]):
    run, node = flown
    node.line("position", run.tick)
    node.ask(0.375)
    assert node.line("remark", run.tick)["remark"] == "0.375 of the arm's weight is asked for; the guard decides."
    assert run.told == [FeltLevel(0.375)]
    node.ask(1.5)
    assert "1.5 is refused" in node.line("remark", run.tick)["remark"]
    assert run.told == [FeltLevel(0.375)]

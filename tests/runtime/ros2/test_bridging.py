"""A program that uses Zenoh as rmw_zenoh does sees the node and its joint states, and may ask for a level."""

import contextlib
import json
import math
import os
import queue
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.errors import ConfigError
from exograv.recording import read_recording
from exograv.recording.encoding import tick_dtype
from exograv.runtime.control_loop.exchange import FeltLevel, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.ros2.bridge import GRAVITY_LEVEL, JOINT_STATES, REMARK, SAFE_STATE, WANTED
from exograv.runtime.ros2.bridging import Bridging, Ros2
from exograv.runtime.ros2.keys import topic_key
from exograv.runtime.ros2.messages import FLOAT64, JOINT_STATE, STRING, float64, joint_state, string
from exograv.safety.guard import SafeState

pytest.importorskip("zenoh")

JOINTS = ("shoulder_flexion", "elbow_flexion")
SETTINGS = {"rig": "recupera_like"}
AHEAD_S = 5e4
"""Lead of the rig's clock over CLOCK_MONOTONIC in this test [s]."""

OLD_S = 0.004
"""Time from a measurement to the decision [s]."""

SOON_S = 20.0  # for a slow computer; no tested event takes so long
STAMP_NS = 2_000_000  # correction of the wall clock between two readings


class Peer:
    """Process on the side of ROS 2."""

    def __init__(self, port: int):
        program = [sys.executable, str(Path(__file__).with_name("peer.py")), str(port)]
        self._process = subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.port = port
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._reading = threading.Thread(target=self._read)
        self._reading.start()
        self.wait_for(lambda line: "ready" in line)

    def wait_for(self, is_it: Callable[[dict[str, Any]], bool], meanwhile: Callable[[], object] = lambda: None):
        """Return the next line that fits; the error shows the lines before it."""
        until, before = time.monotonic() + SOON_S, []
        while time.monotonic() < until:
            meanwhile()
            with contextlib.suppress(queue.Empty):
                line = self._lines.get(timeout=0.005)
                if is_it(line):
                    return line
                before.append(line)
        raise AssertionError(f"not said; but {before[-5:]}")

    def forget(self) -> None:
        """Discard the lines of an earlier bridge until there are no more."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._lines.get(timeout=0.2)

    def send(self, message: bytes) -> None:
        assert self._process.stdin is not None
        print(topic_key(0, WANTED, FLOAT64), message.hex(), file=self._process.stdin, flush=True)

    def close(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(SOON_S)
        self._reading.join(SOON_S)
        self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(json.loads(line))


class Run:
    """Mock of a live run: a recorder, a guard that ticks, and the bridge."""

    def __init__(self, recorder: Recorder, states: Mailbox, bridging: Bridging, peer: Peer):
        self.recorder, self.bridging, self.peer, self.told = recorder, bridging, peer, list[FeltLevel]()
        self._states, self._ticks, self.put_in = states, recorder.inlet.ticks(), list[np.ndarray]()
        self._state = np.zeros((), state_dtype(len(JOINTS)))
        self.safe_state, self.v = SafeState.NONE, (0.5, -0.5)
        bridging.begin(recorder, states, self.told.append)

    def tick(self) -> None:
        row = np.zeros((), tick_dtype(len(JOINTS)))
        row["cdr_header"], row["monotonic"] = (0, 1, 0, 0), time.monotonic()
        row["now"] = row["monotonic"] + AHEAD_S
        row["t"], row["sequence"] = row["now"] - OLD_S, len(self.put_in) + 1
        row["q_measured"], row["v"], row["tau_measured"] = (0.1, len(self.put_in)), self.v, (3.0, -4.0)
        row["gravity_level"], row["safe_state"] = 0.25, self.safe_state + 1
        self._ticks.put(row)
        self.put_in.append(row)
        self._state["now"], self._state["safe_state"] = row["now"], self.safe_state
        self._states.write(self._state)
        self.bridging.check()

    def message(self, topic: str, is_it: Callable[[bytes], bool] = lambda _: True) -> dict[str, Any]:
        """Return the next message of this topic that fits."""

        def fits(line: dict[str, Any]) -> bool:
            return line.get("key", "").startswith(f"0{topic}/") and is_it(bytes.fromhex(line["message"]))

        return self.peer.wait_for(fits, self.tick)

    def ask(self, level: float) -> str:
        """Ask for a level over ROS 2, and return the bridge's remark."""
        self.peer.send(float64(level))
        said = self.message(REMARK, lambda message: message[8:].startswith(f"{level:g} ".encode()))
        return bytes.fromhex(said["message"])[8:-1].decode()

    def close(self) -> None:
        self._ticks.close()


@pytest.fixture(scope="module")
def peer() -> Iterator[Peer]:
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    with contextlib.closing(Peer(port)) as made:
        yield made


@contextlib.contextmanager
def running(folder: Path, peer: Peer, accepts: bool) -> Iterator[Run]:
    peer.forget()
    bridging = Bridging(Ros2(f"tcp/localhost:{peer.port}", accepts, 0), JOINTS)
    with (
        Recorder(folder / "a.mcap", JOINTS, SETTINGS, 5.0) as recorder,
        contextlib.closing(Mailbox(state_dtype(len(JOINTS)))) as states,
        contextlib.closing(bridging),
        contextlib.closing(Run(recorder, states, bridging, peer)) as made,
    ):
        yield made


@pytest.fixture(scope="module")
def telling(tmp_path_factory: pytest.TempPathFactory, peer: Peer) -> Iterator[Run]:
    """Run without requests, shared by tests that only listen."""
    with running(tmp_path_factory.mktemp("telling"), peer, False) as made:
        yield made


@pytest.fixture(params=[True], ids=["accepting"])
def run(request: pytest.FixtureRequest, tmp_path: Path, peer: Peer) -> Iterator[Run]:
    with running(tmp_path, peer, request.param) as made:
        yield made


def test_joint_states_have_the_time_of_their_measurement_and_their_source(telling: Run):
    offset_ns = time.time_ns() - time.monotonic_ns()
    got = [telling.message(JOINT_STATES) for _ in range(12)]
    assert {one["key"] for one in got} == {topic_key(0, JOINT_STATES, JOINT_STATE)}
    beside = [bytes.fromhex(one["attachment"]) for one in got]
    numbers = [struct.unpack_from("<q", one)[0] for one in beside]
    assert np.diff(numbers).tolist() == [1] * 11
    assert len({one[16:] for one in beside}) == 1
    for one in got:
        message = bytes.fromhex(one["message"])
        second = struct.unpack_from("<i", message, 4)[0] * 10**9 + struct.unpack_from("<I", message, 8)[0]
        row = telling.put_in[round(struct.unpack_from("<d", message, message.index(struct.pack("<d", 0.1)) + 8)[0])]
        assert message == joint_state(second, JOINTS, row["q_measured"].tolist(), telling.v, (3.0, -4.0))
        measured_ns = round(1e9 * (float(row["monotonic"]) - OLD_S)) + offset_ns
        assert abs(second - measured_ns) < STAMP_NS


def test_gravity_level_and_safe_state_in_force_are_published(telling: Run):
    level, state = telling.message(GRAVITY_LEVEL), telling.message(SAFE_STATE)
    assert level["key"] == topic_key(0, GRAVITY_LEVEL, FLOAT64)
    assert level["message"] == float64(0.25).hex()
    assert state["key"] == topic_key(0, SAFE_STATE, STRING)
    assert state["message"] == string("none").hex()
    telling.safe_state = SafeState.DAMPING
    telling.message(SAFE_STATE, lambda message: message == string("damping"))
    telling.safe_state = SafeState.NONE


def test_a_velocity_that_is_unknown_is_left_out(telling: Run):
    telling.v = (0.5, math.nan)
    telling.message(JOINT_STATES, lambda m: m.endswith(struct.pack("<IIdd", 0, 2, 3.0, -4.0)))


def test_the_graph_has_the_node_its_publishers_and_its_subscription_until_the_run_is_over(run: Run):
    there = [run.peer.wait_for(lambda line: line.get("is_there") is True)["token"] for _ in range(6)]
    kinds = sorted(token.split("/")[5] for token in there)
    assert kinds == ["MP"] * 4 + ["MS", "NN"]
    assert {token.split("/")[8] for token in there} == {"exograv"}
    assert len({token.split("/")[4] for token in there}) == 6
    run.bridging.close()
    gone = {run.peer.wait_for(lambda line: line.get("is_there") is False)["token"] for _ in range(6)}
    assert gone == set(there)


def test_a_requested_level_goes_to_the_guard_and_into_the_recording(run: Run):
    run.message(JOINT_STATES)
    assert run.ask(0.375) == "0.375 of the arm's weight is asked for; the guard decides."
    assert run.told == [FeltLevel(0.375)]
    assert run.bridging.figures().levels[0].gravity_level == 0.375
    run.recorder.finish()
    (message,) = read_recording(run.recorder.path).messages("/control")
    assert {name: message[name] for name in ("act", "gravity_level")} == {"act": "level", "gravity_level": 0.375}
    assert message["t"] in [float(row["now"]) for row in run.put_in]


def test_an_invalid_level_is_refused_with_the_reason(run: Run):
    run.message(JOINT_STATES)
    assert run.ask(1.5) == "1.5 is refused: allowed are 0 (weightless) to 1 (Earth)."
    assert run.ask(math.nan).startswith("nan is refused")
    run.peer.send(b"\0\1\0\0\0")
    run.message(REMARK, lambda message: b"is no std_msgs/msg/Float64" in message)
    assert run.told == []


@pytest.mark.slow
@pytest.mark.parametrize("run", [False], indirect=True, ids=["not accepting"])
def test_without_the_operator_s_consent_no_level_is_accepted(run: Run):
    run.message(JOINT_STATES)
    assert "--ros2-accept-gravity-level" in run.ask(0.5)
    assert run.told == []
    assert sum(run.bridging.figures().refused.values()) == 1


@pytest.mark.parametrize(
    ("number", "words"),
    [(signal.SIGKILL, "exit status -9"), (signal.SIGSTOP, "was silent for")],
    ids=["killed", "hanging"],
)
def test_a_bridge_that_is_killed_or_hangs_is_noted_and_the_run_goes_on(
    run: Run, number: signal.Signals, words: str, monkeypatch: pytest.MonkeyPatch
):
    # Not less: a parent that stood still for half of it blames itself.
    monkeypatch.setattr("exograv.runtime.ros2.bridging.HANGS_S", 2.0)
    run.message(JOINT_STATES)
    pid = run.bridging.pid
    os.kill(pid, number)

    def ended() -> str:
        run.tick()
        return run.bridging.figures().ended

    assert words in wait_until(ended, "the end of the bridge", SOON_S)
    put_in = len(run.put_in)
    for _ in range(50):
        run.tick()
    assert run.recorder.finish().acknowledged == put_in + 50
    run.bridging.close()
    assert not Path(f"/proc/{pid}").exists()


@pytest.mark.long
def test_a_bridge_that_does_not_answer_at_the_end_of_a_run_is_told(run: Run):
    run.message(JOINT_STATES)
    os.kill(run.bridging.pid, signal.SIGSTOP)
    run.bridging.close()
    assert "did not answer at the end" in run.bridging.figures().ended


def test_a_bridge_that_ends_as_asked_is_not_told_as_lost(run: Run):
    run.message(JOINT_STATES)
    run.bridging.close()
    figures = run.bridging.figures()
    assert figures.ended == ""
    assert figures.joint_states


def test_an_invalid_router_is_refused_before_anything_moves(tmp_path: Path):
    bridging = Bridging(Ros2("localhost:7447", domain=0), JOINTS)
    with (
        Recorder(tmp_path / "a.mcap", JOINTS, SETTINGS, 5.0) as recorder,
        contextlib.closing(Mailbox(state_dtype(2))) as states,
        contextlib.closing(bridging),
        pytest.raises(ConfigError, match="--ros2-router is 'localhost:7447'"),
    ):
        bridging.begin(recorder, states, print)


@pytest.mark.parametrize("text", ["-1", "233", "lab"])
def test_an_invalid_domain_is_refused(text: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(ConfigError, match=f"ROS_DOMAIN_ID is '{text}'"):
        Ros2()

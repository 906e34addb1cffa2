"""ROS 2 itself gives our types the hashes that we publish, and reads the bytes of our messages.

`rclpy` of the Python registry has Fast DDS below it, not Zenoh. So its node judges types and messages; keys, tokens and
attachments are judged by a foreign node over Zenoh (test_foreign_node.py).
"""

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.peers_python import own_environment, peers_python

from exograv.runtime.ros2.messages import FLOAT64, JOINT_STATE, STRING, MessageType, float64, joint_state, string

PYTHON = peers_python("rclpy", "sensor_msgs", "std_msgs")
STAMP_NS = 1_700_000_000_123_456_789
NAMES, ROWS = ("shoulder_flexion", "elbow"), {"position": [0.5, -1.25], "velocity": [0.0, 2.0], "effort": [3.0, 4.0]}

Ask = Callable[[MessageType, bytes], dict[str, Any]]


@pytest.fixture(scope="module")
def judge() -> Iterator[tuple[dict[str, str], Ask]]:
    """Start the node; return its hashes, and a function that shows how it reads a message."""
    program = [PYTHON, str(Path(__file__).with_name("real_node.py"))]
    with subprocess.Popen(
        program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=own_environment()
    ) as node:
        assert node.stdin is not None
        assert node.stdout is not None
        written, read = node.stdin, node.stdout

        def ask(kind: MessageType, message: bytes) -> dict[str, Any]:
            print(kind.name, message.hex(), file=written, flush=True)
            return json.loads(read.readline())

        yield json.loads(read.readline()), ask
        written.close()


def test_ros_2_gives_our_types_the_same_hashes(judge: tuple[dict[str, str], Ask]):
    hashes, _ = judge
    assert hashes == {kind.name: kind.hash for kind in (JOINT_STATE, FLOAT64, STRING)}


def test_ros_2_reads_our_joint_state_and_writes_one_of_the_same_length(judge: tuple[dict[str, str], Ask]):
    _, ask = judge
    message = joint_state(STAMP_NS, NAMES, *ROWS.values())
    read = ask(JOINT_STATE, message)
    # ROS 2 leaves the bytes between aligned values as they were in memory, so only the length can be compared.
    assert len(bytes.fromhex(read.pop("written"))) == len(message)
    assert read == {"stamp_ns": STAMP_NS, "name": list(NAMES), **ROWS}


def test_ros_2_reads_a_joint_state_without_velocities(judge: tuple[dict[str, str], Ask]):
    _, ask = judge
    read = ask(JOINT_STATE, joint_state(STAMP_NS, NAMES, ROWS["position"], [], ROWS["effort"]))
    assert (read["velocity"], read["effort"]) == ([], ROWS["effort"])


@pytest.mark.parametrize("text", ["none", "", "Größer als ½"])
def test_ros_2_reads_our_texts_and_numbers(judge: tuple[dict[str, str], Ask], text: str):
    _, ask = judge
    assert ask(STRING, string(text))["data"] == text
    number = ask(FLOAT64, float64(0.375))
    assert (number["data"], number["written"]) == (0.375, float64(0.375).hex())

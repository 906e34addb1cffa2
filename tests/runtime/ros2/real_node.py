"""Node of ROS 2 itself (`rclpy`): it reads messages in hexadecimal from standard input, and writes lines of JSON.

A line `TYPE HEX` gives the fields of the message and its bytes as ROS 2 writes them again. At the start each type's
hash is shown, as ROS 2's graph reports it.
"""

import json
import sys
import time
from typing import Any

import rclpy  # pyright: ignore[reportMissingImports] - no dependency of the project
from rclpy.serialization import deserialize_message, serialize_message  # pyright: ignore[reportMissingImports]
from sensor_msgs.msg import JointState  # pyright: ignore[reportMissingImports]
from std_msgs.msg import Float64, String  # pyright: ignore[reportMissingImports]

SOON_S = 20.0
TYPES = {
    "sensor_msgs/msg/JointState": JointState,
    "std_msgs/msg/Float64": Float64,
    "std_msgs/msg/String": String,
}


def hash_of(node: "rclpy.node.Node", number: int, kind: type) -> str:
    """Return the hash of a type in the graph of ROS 2."""
    node.create_publisher(kind, f"topic_{number}", 1)
    until = time.monotonic() + SOON_S
    while time.monotonic() < until:
        if found := node.get_publishers_info_by_topic(f"/topic_{number}"):
            return str(found[0].topic_type_hash)
        time.sleep(0.05)
    return ""


def fields_of(message: Any) -> dict[str, object]:
    """Return the fields that the tests compare."""
    if isinstance(message, JointState):
        stamp = message.header.stamp
        rows = {name: list(getattr(message, name)) for name in ("name", "position", "velocity", "effort")}
        return {"stamp_ns": stamp.sec * 10**9 + stamp.nanosec, **rows}
    return {"data": getattr(message, "data", None)}


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("judge")
    print(json.dumps({name: hash_of(node, k, kind) for k, (name, kind) in enumerate(TYPES.items())}), flush=True)
    for line in sys.stdin:
        name, content = line.split()
        message = deserialize_message(bytes.fromhex(content), TYPES[name])
        print(json.dumps({**fields_of(message), "written": serialize_message(message).hex()}), flush=True)


if __name__ == "__main__":
    main()

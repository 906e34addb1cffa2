"""Node of PyZeROS in a process of its own: `python foreign_node.py PORT`. Neither the project nor ROS 2 is imported.

It prints each message that arrives as a line of JSON, and publishes each number on its standard input as a level.
PyZeROS computes names, hashes, bytes and attachments itself; its authors test it with nodes of `rmw_zenoh_cpp`.
"""

import asyncio
import json
import sys
from typing import Any

import asyncio_for_robotics as afor  # pyright: ignore[reportMissingImports] - no dependency of the project
import pyzeros  # pyright: ignore[reportMissingImports]
import zenoh  # pyright: ignore[reportMissingImports]
from ros2_pyterfaces.cydr.all_msgs import Float64, JointState, String  # pyright: ignore[reportMissingImports]


def say(**what: object) -> None:
    print(json.dumps(what), flush=True)


def plain(values: Any) -> list:
    """Return a list of what JSON can write."""
    return [one.decode() if isinstance(one, bytes) else one for one in getattr(values, "tolist", lambda: values)()]


def show_state(state: JointState) -> None:
    stamp = state.header.stamp
    rows = {name: plain(getattr(state, name)) for name in ("name", "position", "velocity", "effort")}
    say(**rows, stamp_ns=int(stamp.sec) * 10**9 + int(stamp.nanosec))


def show_remark(remark: String) -> None:
    say(remark=remark.data.decode() if isinstance(remark.data, bytes) else str(remark.data))


@afor.scoped
async def main() -> None:
    states, remarks = pyzeros.Sub(JointState, "/joint_states"), pyzeros.Sub(String, "/exograv/remark")
    states.asap_callback.append(show_state)
    remarks.asap_callback.append(show_remark)
    levels = pyzeros.Pub(Float64, "/exograv/gravity_level_wanted")
    say(ready=True)
    while line := await asyncio.to_thread(sys.stdin.readline):
        levels.publish(Float64(data=float(line)))


if __name__ == "__main__":
    config = {"mode": "client", "connect": {"endpoints": [f"tcp/localhost:{sys.argv[1]}"]}}
    with (
        zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session,
        pyzeros.auto_context(node="judge", zenoh_session=session),
    ):
        asyncio.run(main())

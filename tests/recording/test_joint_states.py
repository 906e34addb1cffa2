"""Joint states of ROS recordings are read by the names of the joints, and broken messages are refused."""

import json
import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from exograv.errors import RecordingError
from exograv.recording import read_log
from exograv.recording.joint_states import read_joint_states, read_wrenches
from exograv.runtime.ros2.messages import joint_state

JOINTS = ("turn", "lift")
ORDER = ("lift", "finger", "turn")  # the driver's order, with a joint of its own
T = 0.01 * np.arange(300)
Q = np.sin(T[:, None] * np.array([1.0, 2.0, 3.0]))
V = np.cos(T[:, None] * np.array([1.0, 2.0, 3.0])) * np.array([1.0, 2.0, 3.0])
START_NS = 1_700_000_000_000_000_000


def cdr(k: int, with_velocity: bool = True) -> bytes:
    stamp = START_NS + round(1e9 * T[k])
    return joint_state(stamp, ORDER, Q[k].tolist(), V[k].tolist() if with_velocity else [], (5.0 * V[k]).tolist())


def ros1(k: int) -> bytes:
    stamp = START_NS + round(1e9 * T[k])
    parts = [struct.pack("<III", k, stamp // 10**9, stamp % 10**9), struct.pack("<I", 0), struct.pack("<I", 3)]
    parts += [struct.pack("<I", len(name)) + name.encode() for name in ORDER]
    parts += [struct.pack("<I3d", 3, *values) for values in (Q[k], V[k], 5.0 * V[k])]
    return b"".join(parts)


def as_json(k: int) -> bytes:
    stamp = START_NS + round(1e9 * T[k])
    return json.dumps(
        {"header": {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}, "name": ORDER,
         "position": Q[k].tolist(), "velocity": V[k].tolist(), "effort": (5.0 * V[k]).tolist()}
    ).encode()  # fmt: skip


WRENCH = np.column_stack([np.sin(T * k) for k in range(1, 7)])


def wrench_cdr(k: int, frame: str = "ft") -> bytes:
    stamp, name = START_NS + round(1e9 * T[k]), frame.encode() + b"\0"
    head = struct.pack("<III", stamp // 10**9, stamp % 10**9, len(name)) + name
    return b"\x00\x01\x00\x00" + head + bytes(-len(head) % 8) + struct.pack("<6d", *WRENCH[k])


def wrench_ros1(k: int) -> bytes:
    stamp = START_NS + round(1e9 * T[k])
    return struct.pack("<IIII2s6d", k, stamp // 10**9, stamp % 10**9, 2, b"ft", *WRENCH[k])


def wrench_json(k: int) -> bytes:
    stamp, (force, torque) = START_NS + round(1e9 * T[k]), np.split(WRENCH[k], 2)
    axes = [dict(zip("xyz", part.tolist(), strict=True)) for part in (force, torque)]
    head = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "ft"}
    return json.dumps({"header": head, "wrench": {"force": axes[0], "torque": axes[1]}}).encode()


def write_mcap(
    path: Path, encoding: str, message: Callable[[int], bytes], kind: str = "sensor_msgs/msg/JointState"
) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema(kind, "ros2msg", b"")
        channel = writer.register_channel("/joint_states", encoding, schema)
        for k in range(len(T)):
            writer.add_message(channel, START_NS + round(1e9 * T[k]), message(k), START_NS)
        writer.finish()
    return path


def write_bag(folder: Path) -> Path:
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    with sqlite3.connect(folder / "log_0.db3") as bag:
        bag.execute("create table topics (id integer, name text, type text)")
        bag.execute("create table messages (topic_id integer, timestamp integer, data blob)")
        bag.execute("insert into topics values (1, '/tf', 'tf2_msgs/msg/TFMessage')")
        bag.execute("insert into topics values (2, '/joint_states', 'sensor_msgs/msg/JointState')")
        bag.execute("insert into messages values (1, 0, x'00')")
        bag.executemany("insert into messages values (2, ?, ?)", [(k, cdr(k)) for k in range(len(T))])
    bag.close()
    return folder


@pytest.mark.parametrize("kind", ["cdr", "ros1", "json", "bag"])
def test_each_encoding_gives_the_joints_of_the_description_in_its_order(tmp_path: Path, kind: str):
    if kind == "bag":
        path = write_bag(tmp_path / "bag")
    else:
        path = write_mcap(tmp_path / "log.mcap", kind, {"cdr": cdr, "ros1": ros1, "json": as_json}[kind])
    log = read_log(path, JOINTS)
    np.testing.assert_allclose(log.t, T, atol=1e-6)
    np.testing.assert_allclose(log.q, Q[:, [2, 0]])
    np.testing.assert_allclose(log.v, V[:, [2, 0]])
    np.testing.assert_allclose(log.effort, 5.0 * V[:, [2, 0]])


STAMPED = "geometry_msgs/msg/WrenchStamped"


@pytest.mark.parametrize(("kind", "message"), [("cdr", wrench_cdr), ("ros1", wrench_ros1), ("json", wrench_json)])
def test_each_encoding_gives_the_wrenches_with_their_frame(tmp_path: Path, kind: str, message: Callable[[int], bytes]):
    found = read_wrenches(write_mcap(tmp_path / "log.mcap", kind, message, STAMPED))
    assert found is not None
    assert found.frame == "ft"
    np.testing.assert_allclose(found.t - found.t[0], T, atol=1e-6)
    np.testing.assert_allclose(found.wrench, WRENCH)


def test_wrenches_of_two_frames_are_refused_and_a_recording_may_have_none(tmp_path: Path):
    path = write_mcap(tmp_path / "two.mcap", "cdr", lambda k: wrench_cdr(k, ("ft", "tool")[k % 2]), STAMPED)
    with pytest.raises(RecordingError, match="at the frames ft, tool"):
        read_wrenches(path)
    assert read_wrenches(write_mcap(tmp_path / "none.mcap", "cdr", cdr)) is None


@given(cut=st.integers(0, len(wrench_cdr(0)) - 1))
def test_a_wrench_that_was_cut_is_refused(cut: int, tmp_path_factory: pytest.TempPathFactory):
    path = write_mcap(tmp_path_factory.mktemp("cut") / "log.mcap", "cdr", lambda k: wrench_cdr(k)[:cut], STAMPED)
    with pytest.raises(RecordingError, match="cannot be read as wrenches"):
        read_wrenches(path)


def test_missing_velocities_are_the_derivative_of_the_positions(tmp_path: Path):
    path = write_mcap(tmp_path / "log.mcap", "cdr", lambda k: cdr(k, with_velocity=False))
    np.testing.assert_allclose(read_joint_states(path, JOINTS).v[1:-1], V[1:-1, [2, 0]], atol=1e-3)


def test_a_recording_without_these_joints_names_those_that_it_has(tmp_path: Path):
    path = write_mcap(tmp_path / "log.mcap", "cdr", cdr)
    with pytest.raises(RecordingError, match="Joints there: finger, lift, turn"):
        read_joint_states(path, ("shoulder",))


def test_a_recording_without_joint_states_and_a_bag_of_ros_1_are_refused_with_the_next_step(tmp_path: Path):
    with pytest.raises(RecordingError, match="no JointState"):
        read_joint_states(write_mcap(tmp_path / "log.mcap", "cdr", cdr, "std_msgs/msg/String"), JOINTS)
    (tmp_path / "old.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(RecordingError, match="rosbags-convert"):
        read_joint_states(tmp_path / "old.bag", JOINTS)


@given(cut=st.integers(0, len(cdr(0)) - 1))
def test_a_message_that_was_cut_is_refused(cut: int, tmp_path_factory: pytest.TempPathFactory):
    path = write_mcap(tmp_path_factory.mktemp("cut") / "log.mcap", "cdr", lambda k: cdr(k)[:cut])
    with pytest.raises(RecordingError, match="cannot be read as joint states"):
        read_joint_states(path, JOINTS)

"""Recordings of an empty machine in the forms of other programs, made from one of exograv."""

import json
import sqlite3
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from mcap.writer import Writer

from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.description import RigDescription
from exograv.runtime.ros2.messages import joint_state

START_NS = 1_700_000_000_000_000_000
KIND = "sensor_msgs/msg/JointState"
STAMPED = "geometry_msgs/msg/WrenchStamped"


def by_weight(motions: Sequence[MeasuredMotion]) -> list[tuple[np.ndarray, MeasuredMotion]]:
    """Divide motions where the known weight changes; return the row of the weight with each part."""
    parts = list[tuple[np.ndarray, MeasuredMotion]]()
    for one in motions:
        is_new = (np.diff(np.nan_to_num(one.hung, nan=-1.0), axis=0) != 0.0).any(axis=1)
        ends = [0, *(np.flatnonzero(is_new) + 1).tolist(), len(one.t)]
        for begin, end in pairwise(ends):
            if np.isfinite(one.hung[begin]).all():
                rows = slice(begin, end)
                motor = None if one.q_motor is None else one.q_motor[rows]
                columns = (one.t[rows], one.q[rows], one.current[rows], one.current_asked[rows], one.hung[rows])
                parts.append((one.hung[begin], MeasuredMotion(one.name, *columns, q_motor=motor)))
    return parts


def write_lerobot(folder: Path, description: RigDescription, motion: MeasuredMotion) -> Path:
    """Write a dataset of format 3 with one episode, in numbers of 32 bits as LeRobot does."""
    state = [f"{joint}.{end}" for end in ("pos", "current") for joint in description.joints]
    names = {"observation.state": state, "action": [f"{joint}.current" for joint in description.joints]}
    (folder / "meta").mkdir(parents=True)
    features = {name: {"dtype": "float32", "names": one} for name, one in names.items()}
    fps = round(1.0 / motion.period_s)
    info = {"codebase_version": "v3.0", "fps": fps, "features": features}
    (folder / "meta" / "info.json").write_text(json.dumps(info), encoding="utf-8")
    (folder / "data" / "chunk-000").mkdir(parents=True)
    pq.write_table(_lerobot_table(motion), folder / "data" / "chunk-000" / "file-000.parquet")
    return folder


def write_lerobot_csv(path: Path, motion: MeasuredMotion) -> Path:
    """Write a CSV with the columns of a dataset, whose positions and currents have no names."""
    lines = ["timestamp,observation.state,observation.current,action.current"]
    for t, *groups in zip(
        motion.t - motion.t[0], motion.q.tolist(), motion.current.tolist(), motion.current_asked.tolist(), strict=True
    ):
        lines.append(",".join([f"{t:.6f}", *(f'"[{", ".join(map(str, group))}]"' for group in groups)]))
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def _lerobot_table(motion: MeasuredMotion) -> pa.Table:
    frames = len(motion.t)
    columns = {"observation.state": np.hstack([motion.q, motion.current]), "action": motion.current_asked}
    lists = {name: pa.array(list(one.astype(np.float32)), pa.list_(pa.float32())) for name, one in columns.items()}
    index = np.arange(frames)
    stamps = pa.array((index * motion.period_s).astype(np.float32))
    numbers = {"frame_index": pa.array(index), "episode_index": pa.array(np.zeros(frames, dtype=int))}
    return pa.table({**lists, "timestamp": stamps, **numbers})


def _messages(description: RigDescription, motion: MeasuredMotion) -> list[tuple[int, bytes]]:
    """Return stamp [ns] and CDR of each message, in the driver's order of joints, without velocities."""
    order = description.joints[::-1]
    stamps = [START_NS + round(1e9 * t) for t in motion.t.tolist()]
    rows = zip(stamps, motion.q[:, ::-1].tolist(), motion.current[:, ::-1].tolist(), strict=True)
    return [(stamp, joint_state(stamp, order, q, [], current)) for stamp, q, current in rows]


def write_ros_mcap(
    path: Path, description: RigDescription, motion: MeasuredMotion, force_frame: str | None = None
) -> Path:
    """Write JointState messages with currents as efforts, and those of a force sensor, into an MCAP file."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        write_states(writer, description, motion)
        if motion.wrench is not None:
            write_wrenches(writer, motion.t, motion.wrench, force_frame or description.calibration.mount)
        writer.finish()
    return path


def write_states(writer: Writer, description: RigDescription, motion: MeasuredMotion) -> None:
    """Write JointState messages with currents as efforts."""
    channel = writer.register_channel("/joint_states", "cdr", writer.register_schema(KIND, "ros2msg", b""))
    for stamp, data in _messages(description, motion):
        writer.add_message(channel, stamp, data, stamp)


def write_wrenches(writer: Writer, t: np.ndarray, wrench: np.ndarray, frame: str) -> None:
    """Write WrenchStamped messages of times [s]."""
    channel = writer.register_channel("/wrench", "json", writer.register_schema(STAMPED, "ros2msg", b""))
    for time, row in zip(t.tolist(), wrench, strict=True):
        stamp = START_NS + round(1e9 * time)
        writer.add_message(channel, stamp, _wrench(stamp, frame, row), stamp)


def _wrench(stamp: int, frame: str, row: np.ndarray) -> bytes:
    """Return a WrenchStamped in the JSON of the ROS bridges."""
    force, torque = (dict(zip("xyz", part.tolist(), strict=True)) for part in np.split(row, 2))
    head = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": frame}
    return json.dumps({"header": head, "wrench": {"force": force, "torque": torque}}).encode()


def write_ros_bag(folder: Path, description: RigDescription, motion: MeasuredMotion) -> Path:
    """Write the same messages into the folder of a ROS 2 bag."""
    folder.mkdir()
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n", encoding="utf-8")
    with sqlite3.connect(folder / "log_0.db3") as bag:
        bag.execute("create table topics (id integer, name text, type text)")
        bag.execute("create table messages (topic_id integer, timestamp integer, data blob)")
        bag.execute(f"insert into topics values (1, '/joint_states', '{KIND}')")
        bag.executemany("insert into messages values (1, ?, ?)", _messages(description, motion))
    bag.close()
    return folder


def write_csv(
    path: Path, description: RigDescription, parts: Sequence[tuple[float, MeasuredMotion]], every: int
) -> Path:
    """Write each `every`th tick with the known weight [kg], commands and positions of the motors."""
    stems = ("q", "i", "tau_commanded", "q_motor")
    names = ["t", *(f"{stem}_{joint}" for stem in stems for joint in description.joints), "weight_kg"]
    if any(one.wrench is not None for _, one in parts):
        names += [f"{kind}_{axis}" for kind in ("force", "moment") for axis in "xyz"]
    tables = []
    for kg, one in parts:
        assert one.q_motor is not None
        groups = (one.t[:, None], one.q, one.current, one.current_asked * description.nominal_gain, one.q_motor)
        forces = [] if one.wrench is None else [one.wrench]
        tables.append(np.hstack([*groups, np.full((len(one.t), 1), kg), *forces])[::every])
    np.savetxt(path, np.vstack(tables), delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    return path

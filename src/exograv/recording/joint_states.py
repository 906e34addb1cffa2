"""Joint states and wrenches of ROS recordings: MCAP files and the SQLite files of ROS 2 bags, without ROS."""

import json
import sqlite3
import struct
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float
from mcap.exceptions import McapError
from mcap.reader import make_reader

from exograv.errors import RecordingError

TYPES = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")
WRENCHES = ("geometry_msgs/msg/WrenchStamped", "geometry_msgs/WrenchStamped")
SUFFIXES = (".mcap", ".db3", ".bag")
"""Ends of the names of ROS recordings."""


_Message = TypeVar("_Message")


@dataclass(frozen=True)
class JointStates:
    """Joint states of one recording, one row per message; columns in the order of the requested joints."""

    t: Float[np.ndarray, " sample"]
    """Time stamp of the message since the first one [s]."""

    q: Float[np.ndarray, "sample joint"]
    """Joint positions [rad]."""

    v: Float[np.ndarray, "sample joint"]
    """Joint velocities [rad/s]; the derivative of the positions if the messages contain none."""

    effort: Float[np.ndarray, "sample joint"]
    """Effort, as the driver of the robot writes it: torque [N·m] or motor current [A]."""

    start_s: float
    """Time stamp of the first message [s]."""


@dataclass(frozen=True)
class Wrenches:
    """Measurements of a force sensor in one recording, one row per message, in the order of their time stamps."""

    t: Float[np.ndarray, " sample"]
    """Time stamp of the message [s]."""

    wrench: Float[np.ndarray, "sample 6"]
    """Force [N] and moment [N·m] about the origin of the frame, in its axes."""

    frame: str | None
    """Frame of the messages; None if they state none."""


@dataclass(frozen=True)
class _State:
    stamp_s: float
    names: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


def is_ros_recording(path: Path) -> bool:
    """Return True if the path is a ROS recording: a file with one of `SUFFIXES`, or the folder of a ROS 2 bag."""
    return path.suffix in SUFFIXES or (path.is_dir() and (path / "metadata.yaml").is_file())


def read_joint_states(path: Path, joints: Sequence[str]) -> JointStates:
    """Read all messages of type JointState that contain these joints; other joints and messages are ignored.

    Raises:
        RecordingError: The file cannot be read, or no message has position and effort of all joints.
    """
    seen, count = set[str](), 0
    stamps, q, v, effort = array("d"), array("d"), array("d"), array("d")
    has_velocity = True
    for state in _messages(path, TYPES, _of_json, _fields, "joint states"):
        seen.update(state.names)
        row = _row(state, joints)
        if row is not None:
            count += 1
            stamps.append(row[0])
            q.extend(row[1])
            effort.extend(row[3])
            has_velocity = has_velocity and row[2] is not None
            v.extend(row[2] or ())
    if not count:
        raise RecordingError(
            f"{path} has no JointState message with position and effort of all joints ({', '.join(joints)}). "
            f"Joints there: {', '.join(sorted(seen)) or 'none'}."
        )
    t = np.array(stamps) - stamps[0]
    positions, efforts = (np.array(column).reshape(count, len(joints)) for column in (q, effort))
    if has_velocity:
        return JointStates(t, positions, np.array(v).reshape(count, len(joints)), efforts, stamps[0])
    rising = np.concatenate([[True], np.diff(t) > 0.0])
    if np.count_nonzero(rising) < 2:
        raise RecordingError(f"{path}: the time stamps of the joint states do not rise.")
    t, positions, efforts = t[rising], positions[rising], efforts[rising]
    return JointStates(t, positions, np.gradient(positions, t, axis=0), efforts, stamps[0])


def read_wrenches(path: Path) -> Wrenches | None:
    """Read all messages of type WrenchStamped; None if there are none.

    Raises:
        RecordingError: The file cannot be read, or its messages are of several frames.
    """
    rows = sorted(_messages(path, WRENCHES, _wrench_of_json, _wrench_fields, "wrenches"))
    if not rows:
        return None
    frames = sorted({frame for _, frame, _ in rows})
    if len(frames) > 1:
        raise RecordingError(f"{path} has wrenches at the frames {', '.join(frames)}. Keep those of one force sensor.")
    return Wrenches(np.array([t for t, _, _ in rows]), np.array([list(row) for _, _, row in rows]), frames[0] or None)


def _row(state: _State, joints: Sequence[str]) -> tuple[Any, ...] | None:
    """Return stamp, positions, velocities and efforts of the joints; None if the message does not have them."""
    index = {name: k for k, name in enumerate(state.names)}
    if not all(name in index for name in joints):
        return None
    places = [index[name] for name in joints]
    if min(len(state.position), len(state.effort)) <= max(places):
        return None
    velocity = None if len(state.velocity) <= max(places) else [state.velocity[k] for k in places]
    return state.stamp_s, [state.position[k] for k in places], velocity, [state.effort[k] for k in places]


def _messages(
    path: Path,
    types: Sequence[str],
    of_json: Callable[[Mapping[str, Any]], _Message],
    of_fields: "Callable[[_Cursor], _Message]",
    kind: str,
) -> Iterator[_Message]:
    for file in _files(path):
        if file.suffix == ".bag":
            raise RecordingError(
                f"{file} is a bag of ROS 1. Convert it with `rosbags-convert --src {file.name} --dst out` "
                "(Python package rosbags), then give the folder."
            )
        messages = _of_mcap(file, types) if file.suffix == ".mcap" else _of_sqlite(file, types)
        try:
            for encoding, data in messages:
                yield of_json(json.loads(data)) if encoding == "json" else of_fields(_cursor(encoding, data))
        except (
            OSError,
            McapError,
            sqlite3.Error,
            struct.error,
            KeyError,
            TypeError,
            UnicodeDecodeError,
            ValueError,
        ) as error:
            raise RecordingError(f"{file} cannot be read as {kind}: {error}.") from error


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    files = sorted(file for file in path.iterdir() if file.suffix in SUFFIXES)
    if not files:
        raise RecordingError(f"The folder {path} contains no file that ends in {', '.join(SUFFIXES)}.")
    return files


def _of_mcap(path: Path, types: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if schema is not None and schema.name in types:
                yield channel.message_encoding, message.data


def _of_sqlite(path: Path, types: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    if not path.is_file():
        raise RecordingError(f"The recording {path} does not exist. Check its path.")
    connection = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        topics: Iterable[tuple[int, str]] = connection.execute("select id, type from topics").fetchall()
        for topic in (number for number, kind in topics if kind in types):
            for (data,) in connection.execute(
                "select data from messages where topic_id = ? order by timestamp", [topic]
            ):
                yield "cdr", bytes(data)
    finally:
        connection.close()


def _cursor(encoding: str, data: bytes) -> "_Cursor":
    if encoding == "cdr":
        if len(data) < 4 or data[1] not in (0, 1):
            raise ValueError("the message is no plain CDR")
        return _Cursor(data[4:], "<" if data[1] == 1 else ">", aligned=True, zero_ended=True)
    if encoding == "ros1":
        return _Cursor(data, "<", aligned=False, zero_ended=False)
    raise ValueError(f"the encoding '{encoding}' of the messages is unknown; known are cdr, ros1 and json")


def _of_json(message: Mapping[str, Any]) -> _State:
    seconds = _stamp_of_json(message)
    values = (tuple(float(value) for value in message.get(name, ())) for name in ("position", "velocity", "effort"))
    return _State(seconds, tuple(map(str, message.get("name", ()))), *values)


def _stamp_of_json(message: Mapping[str, Any]) -> float:
    stamp = message.get("header", {}).get("stamp", {})
    return float(stamp.get("sec", 0)) + 1e-9 * float(stamp.get("nanosec", stamp.get("nsec", 0)))


def _wrench_of_json(message: Mapping[str, Any]) -> tuple[float, str, tuple[float, ...]]:
    """Return stamp [s], frame, and force and torque of a WrenchStamped."""
    wrench = message["wrench"]
    values = tuple(float(wrench[part][axis]) for part in ("force", "torque") for axis in "xyz")
    return _stamp_of_json(message), str(message.get("header", {}).get("frame_id", "")), values


def _wrench_fields(cursor: "_Cursor") -> tuple[float, str, tuple[float, ...]]:
    """Return stamp [s], frame, and force and torque of a WrenchStamped."""
    seconds, frame = _header(cursor)
    return seconds, frame, cursor.vector3() + cursor.vector3()


def _header(cursor: "_Cursor") -> tuple[float, str]:
    """Return stamp [s] and frame of a header."""
    if not cursor.aligned:
        cursor.uint32()  # sequence number of a header of ROS 1
    seconds = cursor.uint32() + 1e-9 * cursor.uint32()
    return seconds, cursor.text()


def _fields(cursor: "_Cursor") -> _State:
    seconds, _ = _header(cursor)
    names = tuple(cursor.text() for _ in range(cursor.count(4)))
    return _State(seconds, names, cursor.float64s(), cursor.float64s(), cursor.float64s())


class _Cursor:
    """Reader of serialised fields, one after the other.

    Source: OMG DDSI-RTPS 2.5, section 10 (CDR); ROS wiki, msg (ROS 1: no alignment, texts without a final zero byte).
    """

    def __init__(self, data: bytes, order: str, *, aligned: bool, zero_ended: bool):
        self._data, self._order, self._at = data, order, 0
        self.aligned, self._zero_ended = aligned, zero_ended

    def uint32(self) -> int:
        return int(self._unpack("I", 4, 1)[0])

    def count(self, least_bytes: int) -> int:
        """Return the length of a sequence; a length beyond the message is refused before any memory is used."""
        count = self.uint32()
        if count * least_bytes > len(self._data) - self._at:
            raise ValueError("a sequence is longer than its message")
        return count

    def text(self) -> str:
        length = self.count(1)
        content = self._data[self._at : self._at + length]
        self._at += length
        return (content[:-1] if self._zero_ended else content).decode()

    def float64s(self) -> tuple[float, ...]:
        count = self.count(8)
        return self._unpack("d", 8, count) if count else ()

    def vector3(self) -> tuple[float, ...]:
        return self._unpack("d", 8, 3)

    def _unpack(self, kind: str, size: int, count: int) -> tuple[Any, ...]:
        if self.aligned:
            self._at += -self._at % size
        values = struct.unpack_from(f"{self._order}{count}{kind}", self._data, self._at)
        self._at += size * count
        return values

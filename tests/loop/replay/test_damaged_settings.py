"""A value of the settings or of another record that is wrong, at any depth, is refused with a sentence."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.console.view_recording import recorded_view
from exograv.errors import ExogravError
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.live.live_control import LivePlan
from exograv.live.live_flight import settings_of
from exograv.loop.replay.what_if import AS_RECORDED
from exograv.cli.recordings.replaying import run_replay
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.recording import RecordingWriter, read_recording
from exograv.recording.encoding import empty_ticks
from exograv.report.of_recording.recording_report import page_of
from exograv.results import json_value
from exograv.safety.limits import PersonLimits
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
from fuzz.recording import Inside, sealed, unsealed

from .conftest import SEED, Flown, nothing

HEAD = 22
"""Bytes before the content of a message."""
TICKS = 3

Place = tuple[str | int, ...]


def leaves(value: Any, place: Place = ()) -> Iterator[Place]:
    """Yield the place of each value and of each container; of a list only the first entry is entered."""
    if place:
        yield place
    if isinstance(value, dict):
        for name in value:
            yield from leaves(value[name], (*place, name))
    elif isinstance(value, list) and value:
        yield from leaves(value[0], (*place, 0))


def with_value(message: Any, place: Place, change: Callable[[Any, Any], None]) -> Any:
    changed = json.loads(json.dumps(message))
    inner = changed
    for name in place[:-1]:
        inner = inner[name]
    change(inner, place[-1])
    return changed


def put(value: Any) -> Callable[[Any, Any], None]:
    def change(inner: Any, name: Any) -> None:
        inner[name] = value

    return change


def remove(inner: Any, name: Any) -> None:
    del inner[name]


CHANGES = {
    "missing": remove, "number": put(7), "text": put("x"), "null": put(None), "object": put({}), "list": put([]),
    "huge": put(1e300), "negative": put(-1e9), "zero": put(0), "nan": put(float("nan")), "true": put(True),
}  # fmt: skip


@pytest.fixture(scope="module")
def lockstep(flown: Flown, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Recording of a run in lock-step: its settings, its first messages to control, and a few ticks."""
    source, path = read_recording(flown.path), tmp_path_factory.mktemp("small") / "lockstep.mcap"
    ticks = source.ticks[source.ticks["phase"] == 2][:TICKS]
    messages = source.messages("/control")[: int(ticks["control"][-1])]
    return written(path, source.joints, source.settings, messages, ticks)


@pytest.fixture(scope="module")
def live(flown: Flown, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Recording of a live run: its settings with the start values of guard and control, and a few ticks."""
    laboratory = flown.laboratory
    prepared = ControllerKnowledge(laboratory.assembly(), flown.machine, flown.x, 400.0)
    none, wide, reach = np.zeros((4, Features(4, 2).count)), np.full(4, 20.0), np.full(4, 3.0)
    limits = PersonLimits(
        PlausibleTable((LimbTable((0, 1, 2, 3), 2, none, none),), wide, wide, wide), np.full(4, 30.0), -reach, reach
    )
    machine = cooperative_machine(laboratory, SEED, prepared.t)
    plan = LivePlan(laboratory.description, laboratory.form, prepared, limits, 0.2, machine)
    ticks = read_recording(flown.path).ticks[:TICKS]
    settings = settings_of(plan, {"disturbance_level": 2})
    path = tmp_path_factory.mktemp("small") / "live.mcap"
    return written(path, laboratory.description.joints, json_value(settings), [], ticks)


def written(path: Path, joints: Any, settings: Any, messages: Any, ticks: np.ndarray) -> bytes:
    kept = {name: value for name, value in settings.items() if name not in ("schema_version", "joints")}
    with RecordingWriter(path, joints, kept) as recording:
        for message in messages:
            recording.write("/control", message["t"], {k: v for k, v in message.items() if k != "t"})
        for name in ("calibrate", "identify"):
            recording.phase(0.0, name)
        recording.ticks(ticks)
    return path.read_bytes()


def use(path: Path) -> None:
    """Read a recording as report, view and replay do; errors of exograv are allowed."""
    for reader in (
        lambda: page_of(read_recording(path)),
        lambda: recorded_view(path, None, None),
        lambda: run_replay(path, None, nothing, AS_RECORDED),
    ):
        try:
            reader()
        except ExogravError:
            pass


def test_hunt(lockstep: bytes, live: bytes, tmp_path: Path):
    import collections, os, time, traceback, warnings

    warnings.simplefilter("ignore")
    topics = os.environ.get("HUNT", "/settings").split(",")
    bad = collections.Counter()
    t0 = time.time()
    for name, data in (("lockstep", lockstep), ("live", live)):
        channels, chunks = unsealed(data)
        for topic in topics:
            number = 1 + [one for one, *_ in channels].index(topic)
            spots = [(i, k) for i, chunk in enumerate(chunks) for k, (n, _b) in enumerate(chunk) if n == number]
            for i, k in spots:
                body = chunks[i][k][1]
                message = json.loads(body[HEAD:])
                for place in leaves(message):
                    for kind, change in CHANGES.items():
                        try:
                            content = json.dumps(with_value(message, place, change)).encode()
                        except Exception:
                            continue
                        new = [list(chunk) for chunk in chunks]
                        new[i][k] = number, body[:HEAD] + content
                        path = tmp_path / "damaged.mcap"
                        path.write_bytes(sealed(Inside(channels, new)))
                        try:
                            use(path)
                        except Exception as error:
                            where = traceback.extract_tb(error.__traceback__)[-1]
                            at = [f for f in traceback.extract_tb(error.__traceback__) if "exograv" in f.filename][-1]
                            key = f"{name} {topic} {'.'.join(map(str, place))} {kind}: {type(error).__name__} {str(error)[:60]} at {at.filename.split('exograv/')[-1]}:{at.lineno}"
                            bad[key] += 1
                            print(key, flush=True)
    print(len(bad), time.time() - t0)
    assert not bad

"""A value of the settings or of another record that is wrong, at any depth, is refused with a sentence."""

import contextlib
import itertools
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.cli.recordings.replaying import run_replay
from exograv.console.view_recording import recorded_view
from exograv.errors import ExogravError, RecordingError
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.live.live_control import LivePlan
from exograv.live.live_flight import settings_of
from exograv.loop.replay.what_if import AS_RECORDED
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.recording.fields import Message
from exograv.report.of_recording.headline import headline, run_facts, tiles
from exograv.report.of_recording.tables import calibration_table, event_table, parameter_table, settings_table
from exograv.results import json_value
from exograv.safety.limits import PersonLimits
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
from exograv.study.targets import targets
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
    "missing": remove, "number": put(7), "text": put("x"), "object": put({}), "list": put([]),
    "negative": put(-1e9), "nan": put(float("nan")),
}  # fmt: skip

UNREAD = {("settings", "rig"), ("settings", "options")}
"""Values that only the table of settings shows."""


@pytest.fixture(scope="module")
def lockstep(flown: Flown, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Recording of a run in lock-step: its settings, its first messages to control, and a few ticks."""
    source, path = read_recording(flown.path), tmp_path_factory.mktemp("small") / "lockstep.mcap"
    ticks = source.ticks[source.ticks["phase"] == 2][:TICKS]
    messages = source.messages("/control")[: int(ticks["control"][-1])]
    return written(path, source.joints, source.settings, {"/control": messages, "/guard": states(source, ticks)}, ticks)


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
    of_guard = {"/guard": states(read_recording(flown.path), ticks)}
    return written(path, laboratory.description.joints, json_value(settings), of_guard, ticks)


def states(source: Recording, ticks: np.ndarray) -> list[Message]:
    """Return a state of the guard for each tick."""
    later = [message for message in source.messages("/guard") if message["now"] >= ticks["now"][0]]
    return [{**message, "now": float(now)} for message, now in zip(later, ticks["now"], strict=False)]


def written(path: Path, joints: Any, settings: Any, messages: Any, ticks: np.ndarray) -> bytes:
    """Write a recording that lacks its second tick, so that a replay puts a state of the guard back."""
    kept = {name: value for name, value in settings.items() if name not in ("schema_version", "joints")}
    with RecordingWriter(path, joints, kept) as recording:
        for topic, of_topic in messages.items():
            for message in of_topic:
                recording.write(topic, message["t"], {k: v for k, v in message.items() if k != "t"})
        for name in ("calibrate", "identify"):
            recording.phase(0.0, name)
        recording.ticks(np.delete(ticks, 1))
    return path.read_bytes()


def use(path: Path) -> None:
    """Read a recording as report, view and replay do. Figures are left out, because drawing them takes seconds."""
    recording = read_recording(path)
    for show in (run_facts, headline, tiles, settings_table, parameter_table, calibration_table, event_table, targets):
        show(recording)
    for reader in (lambda: recorded_view(path, None, None), lambda: run_replay(path, None, nothing, AS_RECORDED)):
        with contextlib.suppress(ExogravError):
            reader()


def damaged(data: bytes, topic: str) -> Iterator[tuple[str, bytes]]:
    """Yield a description and the file for each change of each value in the messages of a topic."""
    channels, chunks = unsealed(data)
    number = 1 + [one for one, *_ in channels].index(topic)
    spots = [(i, k) for i, chunk in enumerate(chunks) for k, (n, _) in enumerate(chunk) if n == number]
    for i, k in spots:
        body = chunks[i][k][1]
        message = json.loads(body[HEAD:])
        for place in leaves(message):
            if place[:2] in UNREAD:
                continue
            for kind, change in CHANGES.items():
                content = json.dumps(with_value(message, place, change)).encode()
                new = [list(chunk) for chunk in chunks]
                new[i][k] = number, body[:HEAD] + content
                yield f"{topic} {place}: {kind}", sealed(Inside(channels, new))


@pytest.mark.parametrize("step", [60, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["lockstep", "live"])
@pytest.mark.parametrize("topic", ["/settings", "/control", "/guard"])
def test_a_damaged_value_at_any_depth_leads_to_a_result_or_to_an_error_of_exograv(
    request: pytest.FixtureRequest, tmp_path: Path, kind: str, topic: str, step: int
):
    path, failed = tmp_path / "damaged.mcap", []
    data = request.getfixturevalue(kind)
    for what, file in itertools.islice(damaged(data, topic), 0, None, step):
        path.write_bytes(file)
        try:
            # A huge number may overflow in the comparison of the replay, which is no error.
            with contextlib.suppress(ExogravError), np.errstate(over="ignore", invalid="ignore"):
                use(path)
        except Exception as error:  # noqa: BLE001  # every error of another kind is a finding
            failed.append(f"{what}: {type(error).__name__}: {error}")
    assert failed == []


@pytest.mark.parametrize(
    ("place", "change", "said"),
    [
        (("settings", "told", "body", "height_m"), put("tall"), "'settings.told.body.height_m' is \"tall\""),
        (("settings", "told", "body"), put([]), "'settings.told.body' is \\[\\], not of the type object"),
        (("settings", "told", "body", "sex"), remove, "'settings.told.body.sex' is missing"),
        (("settings", "rig_files", "rig.toml"), put(7), "'settings.rig_files.rig.toml' is 7"),
        (("settings", "live", "period_s"), put(0), "'settings.live.period_s' is 0; it must be above 0"),
        (("settings", "live", "machine", "phi", 0), remove, "'settings.live.machine.phi' has 3 values, not 4"),
        (("settings", "live", "person", "table", "chains", 0, "exo", 0, 0), put("x"), r"chains\[0\].exo\[0\]\[0\]' is"),
    ],
)
def test_the_sentence_names_the_damaged_value_with_all_objects_around_it(
    live: bytes, tmp_path: Path, place: Place, change: Callable[[Any, Any], None], said: str
):
    channels, chunks = unsealed(live)
    number = 1 + [one for one, *_ in channels].index("/settings")
    changed = [
        [(k, body[:HEAD] + json.dumps(with_value(json.loads(body[HEAD:]), place, change)).encode()) if k == number
         else (k, body) for k, body in chunk] for chunk in chunks
    ]  # fmt: skip
    path = tmp_path / "damaged.mcap"
    path.write_bytes(sealed(Inside(channels, changed)))
    with pytest.raises(RecordingError, match=said):
        read_recording(path)

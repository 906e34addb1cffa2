"""Reasons why a replay may differ: versions, changed machine files, missing ticks, and replaced inputs."""

from collections.abc import Mapping
from typing import Any

from exograv.errors import ConfigError
from exograv.loop.replay_log import versions
from exograv.model.description import load_rig
from exograv.results import json_value
from exograv.safety.state import VERSION

from .columns import ReplayedDecisions
from .recorded_run import RecordedRun
from .what_if import ReplayOverrides


def circumstances(recorded: RecordedRun, again: ReplayedDecisions, instead: ReplayOverrides) -> list[str]:
    """Sentences about all circumstances that differ from the run, also if the torques are equal."""
    remark = recorded.recording.remark
    found = [] if remark is None else [f"{remark} The part before that was replayed."]
    found += [f"{n} ticks are missing before {t:.3f} s: the filters restarted there." for t, n in again.gaps]
    found += again.surprises
    found += _other_guard(again)
    found += _substituted(instead)
    found += other_versions(recorded.recording.settings.get("versions") or {}, versions())
    found += [] if instead.rig is not None else _other_rig(recorded)
    return found


def other_versions(then: Mapping[str, Any], now: Mapping[str, str]) -> list[str]:
    """Sentences about versions that differ from those at the time of the recording."""
    if not then:
        return ["The recording does not say which versions made it."]
    found = [
        f"{name} was {then.get(name, 'not stated')}, now it is {value}."
        for name, value in now.items()
        if name != "code" and then.get(name) != value
    ]
    same_version = then.get("exograv") == now["exograv"]
    if then.get("code") != now["code"] and same_version:
        found.append(f"The code of exograv {now['exograv']} has been changed since: its modules have another hash.")
    return found


def _other_guard(again: ReplayedDecisions) -> list[str]:
    if not again.guard_version:
        return []
    now = f"{VERSION:08x}"
    return [
        f"The guard of the run has version {again.guard_version}, the present one {now}: their states are not compared."
    ]


def _substituted(instead: ReplayOverrides) -> list[str]:
    return [
        f"{value} took the place of the recorded {name.replace('_', ' ')}."
        for name, value in json_value(instead).items()
        if value is not None
    ]


def _other_rig(recorded: RecordedRun) -> list[str]:
    """Sentences about changes of the machine's folder since the run. The replay uses the recorded files."""
    settings = recorded.recording.settings
    hashes, name = settings.get("hashes") or {}, settings.get("rig", recorded.description.name)
    if hashes.get("rig") != recorded.description.sha256:
        return ["The machine's files in the recording do not match the hash in the recording."]
    options = (settings.get("settings") or {}).get("options") or {}
    asked = options.get("rig", name)
    try:
        present = load_rig(asked, recorded.description.side).sha256
    except ConfigError:
        return [f"There is no machine '{asked}' here; the recording's own files of it were used."]
    if present == hashes["rig"]:
        return []
    return [
        f"rig.toml or URDF of '{asked}' have changed since; the recorded ones were used. --rig {asked} takes the new."
    ]

"""Effort of the muscles: amplitude of EMG relative to a reference contraction, compared between conditions."""

import hashlib
import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import exp

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from exograv.errors import RecordingError
from exograv.study.biosignal_channels import Stated
from exograv.study.dataset.tables import Tables, dtype, frame, schema, write_parquet
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.statistics.findings import Interval, Test
from exograv.study.statistics.paired import PairedFinding, paired_comparison, ratio_interval
from exograv.study.statistics.permutation import permutation_test, shift_interval
from exograv.study.statistics.relabelling import relabellings

from .emg_amplitude import EMG, emg_amplitudes
from .selecting import column, keys, rows
from .stored import ABOUT, recordings_of
from .study_data import PRIMARY, StudyData
from .table import SESSION

VERSION = 1
"""Version of the amplitudes. Increase it when their computation changes: recordings are then read again."""

ALPHA = 0.05
"""Accepted probability of a false positive."""

WEIGHTLESS_MAX, EARTH_MIN = 0.05, 0.95
"""Felt share of the arm's weight up to which a window counts as weightless, and from which as 1 g."""


@dataclass(frozen=True)
class EmgData:
    """Amplitudes of all sessions of a study."""

    amplitudes: pd.DataFrame
    """Table `emg_amplitude.EMG`."""

    remarks: tuple[str, ...]
    """Sentences on streams without amplitudes."""


@dataclass(frozen=True)
class GroupEffort:
    """Effort of the muscles of two groups in the sessions of `PRIMARY`."""

    names: tuple[str, str]
    ratio: float
    """Geometric mean over the people of the first group divided by that of the second."""

    interval: Interval
    test: Test


@dataclass(frozen=True)
class MuscleEffort:
    """Effort of the muscles in weightlessness against that at 1 g."""

    channels: tuple[str, ...]
    weightless_windows: int
    earth_windows: int
    by_person: dict[str, float]
    """Ratio of the effort, weightless to 1 g, by participant: geometric mean over channels and windows."""

    by_channel: dict[str, float]
    """Geometric mean of this ratio over people, by channel."""

    paired: PairedFinding | None
    """Comparison; None without a person who has both conditions."""

    groups: GroupEffort | None
    """Comparison of the study's first two groups in `PRIMARY`; None without people of both."""

    left_out: tuple[str, ...]


def measure_emg(
    folder: StudyFolder, tables: Tables, stated: Stated, tell: Callable[[str], object] = lambda text: None
) -> EmgData:
    """Compute the amplitudes of EMG, and write `derivatives/emg.parquet`. An unchanged recording is not read again.

    Args:
        folder: Folder of the study.
        tables: Its tidy tables.
        stated: Statements of the study about streams.
        tell: Called with the path of each recording with EMG before its samples are read.

    Raises:
        RecordingError: The file cannot be written.
    """
    wanted = recordings_of(tables)
    told = {name: one.model_dump(mode="json") for name, one in sorted(stated.items())}
    version = [VERSION, hashlib.sha256(json.dumps(told).encode()).hexdigest()]
    kept = _kept(folder, version)
    is_same = {key for key, (_, sha256) in wanted.items() if [*key, sha256] in kept.sources}
    names = [*SESSION]
    table = rows(kept.table, np.array([key in is_same for key in keys(kept.table, names)], bool))
    paths = {wanted[key][0] for key in is_same}
    remarks = {path: said for path, said in kept.remarks.items() if path in paths}
    for key in sorted(wanted.keys() - is_same):
        source, _ = wanted[key]
        try:
            place = dict(zip(names, key, strict=True))
            found = emg_amplitudes(folder.source(source), place, stated, partial(tell, source))
        except RecordingError:
            continue  # `measure_study` reports a recording that cannot be read.
        if found.remarks:
            remarks[source] = [f"EMG has no amplitude, because {why}." for why in found.remarks]
        parts = [one for one in (table, frame(EMG, found.rows)) if len(one)]
        table = pd.concat(parts, ignore_index=True) if parts else table
    sources = [[*key, sha256] for key, (_, sha256) in sorted(wanted.items())]
    stored = pa.Table.from_pandas(table, schema=schema(EMG), preserve_index=False)
    about = {"version": version, "sources": sources, "remarks": remarks}
    metadata = {**(stored.schema.metadata or {}), ABOUT: json.dumps(about).encode()}
    write_parquet(folder.table("emg"), stored.replace_schema_metadata(metadata))
    said = tuple(f"{source}: {one}" for source, several in sorted(remarks.items()) for one in several)
    return EmgData(table, said)


@dataclass(frozen=True)
class _Kept:
    """Table of amplitudes that an earlier command has stored, with its sources."""

    table: pd.DataFrame
    sources: list[list[object]]
    """Participant, protocol, session and hash of each recording that was read."""

    remarks: dict[str, list[str]]


def _kept(folder: StudyFolder, version: list[object]) -> _Kept:
    """Return stored amplitudes; nothing of another version or of other statements."""
    nothing = _Kept(frame(EMG, []), [], {})
    try:
        stored = pq.read_table(folder.table("emg"))
        about = json.loads((stored.schema.metadata or {})[ABOUT])
    except (OSError, KeyError, pa.ArrowException):
        return nothing
    if about["version"] != version or stored.schema.names != [one.name for one in EMG]:
        return nothing
    table = stored.to_pandas().astype({one.name: dtype(one) for one in EMG})
    return _Kept(table, about["sources"], about["remarks"])


@dataclass(frozen=True)
class WindowEffort:
    """Effort of one channel in one window."""

    participant: str
    protocol: str
    session: int
    window: int
    attempt: int
    channel: str
    log_effort: float
    """Natural logarithm of the amplitude relative to the reference contraction."""


def relative_efforts(amplitudes: pd.DataFrame, stated: Stated) -> tuple[list[WindowEffort], tuple[str, ...]]:
    """Divide each amplitude by that of the reference contraction of the same participant and channel.

    Returns:
        Efforts without those of the reference windows; sentences on amplitudes that are left out.
    """
    asked = {(one.contraction_window, one.contraction_protocol) for one in stated.values() if one.contraction_window}
    if len(asked) != 1:
        why = "no reference contraction is stated" if not asked else "several reference contractions are stated"
        return [], (f"EMG is not compared: {why} (`contraction_window` in study.toml).",)
    ((window, protocol),) = asked
    references, others = defaultdict[tuple[object, ...], list[float]](list), list[tuple[WindowEffort, float]]()
    for row in amplitudes.to_dict("records"):
        *place, amplitude = (row[one.name] for one in EMG)
        one = WindowEffort(*place, log_effort=0.0)
        if one.window == window and protocol in ("", one.protocol):
            references[_reference_key(one, protocol)].append(amplitude)
        else:
            others.append((one, amplitude))
    known = [(one, amplitude) for one, amplitude in others if _reference_key(one, protocol) in references]
    lost = len(others) - len(known)
    said = (f"{lost} amplitudes of EMG have no reference contraction.",) if lost else ()
    found = [
        replace(one, log_effort=float(np.log(amplitude / np.mean(references[_reference_key(one, protocol)]))))
        for one, amplitude in known
    ]
    return found, said


def _reference_key(one: WindowEffort, protocol: str) -> tuple[object, ...]:
    """Return the key of an effort's reference: of the session, or of the person if it has a protocol of its own."""
    session = () if protocol else (one.protocol, one.session)
    return (one.participant, *session, one.channel)


def means_by(values: Iterable[tuple[tuple[str, ...], float]]) -> dict[tuple[str, ...], float]:
    """Return the mean of the values of each key, in the order of the keys."""
    found = defaultdict[tuple[str, ...], list[float]](list)
    for key, value in values:
        found[key].append(value)
    return {key: float(np.mean(of)) for key, of in sorted(found.items())}


def muscle_effort(data: EmgData, study: StudyData) -> MuscleEffort | None:
    """Compare the effort in weightless windows with that in windows at 1 g; None without EMG.

    A person's value is the mean over channels of the difference of mean log efforts. Only channels with both
    conditions count.
    """
    if data.amplitudes.empty and not data.remarks:
        return None
    efforts, said = relative_efforts(data.amplitudes, study.settings.streams)
    place = [*SESSION, "window", "attempt"]
    windows = study.tables.windows
    levels = dict(zip(keys(windows, place), column(windows, "gravity_level").tolist(), strict=True))
    by_condition = dict[str, list[WindowEffort]]()
    for one in efforts:
        level = levels.get((one.participant, one.protocol, one.session, one.window, one.attempt), np.nan)
        condition = "weightless" if level <= WEIGHTLESS_MAX else "earth" if level >= EARTH_MIN else ""
        by_condition.setdefault(condition, []).append(one)
    weightless, earth = by_condition.get("weightless", []), by_condition.get("earth", [])
    first, second = (
        means_by(((one.participant, one.channel), one.log_effort) for one in of) for of in (weightless, earth)
    )
    differences = {key: first[key] - second[key] for key in first.keys() & second.keys()}
    by_person = means_by(((code,), value) for (code, _), value in differences.items())
    by_channel = means_by(((channel,), value) for (_, channel), value in differences.items())
    lone = sorted({one.participant for one in efforts} - {code for (code,) in by_person})
    only_one = (f"{', '.join(lone)} have EMG under one condition only.",) if lone else ()
    return MuscleEffort(
        channels=tuple(sorted(set(column(data.amplitudes, "channel").tolist()))),
        weightless_windows=_windows(weightless),
        earth_windows=_windows(earth),
        by_person={code: exp(value) for (code,), value in by_person.items()},
        by_channel={channel: exp(value) for (channel,), value in by_channel.items()},
        paired=paired_comparison(np.array([*by_person.values()]), ALPHA) if by_person else None,
        groups=_groups(efforts, study),
        left_out=(*data.remarks, *said, *only_one),
    )


def _windows(efforts: Sequence[WindowEffort]) -> int:
    return len({(one.participant, one.protocol, one.session, one.window, one.attempt) for one in efforts})


def _groups(efforts: Sequence[WindowEffort], study: StudyData) -> GroupEffort | None:
    """Compare the groups by one mean log effort per person, over the channels that all of these people have."""
    names = [*study.settings.groups][:2]
    if len(names) < 2 or study.is_sealed:
        return None
    flown = [one for one in efforts if one.protocol == PRIMARY and study.group_of.get(one.participant) in names]
    codes = sorted({one.participant for one in flown}, key=lambda code: (names.index(study.group_of[code]), code))
    n = sum(study.group_of[code] == names[0] for code in codes)
    means = means_by(((one.participant, one.channel), one.log_effort) for one in flown)
    common = [name for name in sorted({one.channel for one in flown}) if all((code, name) in means for code in codes)]
    if not common or not 0 < n < len(codes):
        return None
    values = np.array([np.mean([means[code, name] for name in common]) for code in codes])
    ways = relabellings(n, len(codes) - n, np.random.default_rng(0))
    shifts = shift_interval(values, ways, 1.0 - ALPHA)
    ratio = exp(float(values[:n].mean() - values[n:].mean()))
    test = permutation_test(values, ways, ALPHA)
    return GroupEffort((names[0], names[1]), ratio, ratio_interval(shifts), test)

"""Methods paragraph from the data: participants, procedure and statistics."""

from collections.abc import Mapping, Sequence

from exograv import __version__
from exograv.report.study_figures.groups import label
from exograv.study.measures.study_data import PRIMARY, StudyData


def methods(data: StudyData, unpublished: Mapping[str, Sequence[str]], tests: Sequence[str]) -> list[str]:
    """Return the paragraphs.

    Args:
        data: The study.
        unpublished: Names of values by protocol that are not the paper's.
        tests: Sentences of the statistics.
    """
    paragraphs = [_people(data), _sessions(data), _touches(data)]
    chosen = "; ".join(f"{protocol}: {', '.join(names)}" for protocol, names in sorted(unpublished.items()) if names)
    if chosen:
        paragraphs.append(
            f"Values of the protocols that are not published but chosen (names as in the protocol file): {chosen}."
        )
    elif not data.tables.sessions.empty:
        paragraphs.append("The sources do not state which values of their protocols are the published ones.")
    if tests:
        paragraphs.append(" ".join(tests))
    simulated = " All data are simulated: nobody took part, and nothing here is evidence about people."
    return [
        *paragraphs,
        f"Figures and tables were made by exograv {__version__}." + (simulated if data.is_simulated else ""),
    ]


def _people(data: StudyData) -> str:
    if data.is_sealed:
        return f"{_count(len(data.group_of), 'person', 'people')} took part. Groups are sealed."
    members = list(data.group_of.values())
    said = [
        f"{members.count(group)} {label(group)} ({data.settings.groups.get(group, 'not described')})"
        for group in data.groups
    ]
    empty = [name for name in data.settings.groups if name not in data.groups]
    more = f" No participant is in the group {', '.join(empty)}." if empty else ""
    return f"{_count(len(members), 'person', 'people')} took part: {'; '.join(said)}.{more}"


def _sessions(data: StudyData) -> str:
    sessions = data.tables.sessions
    if sessions.empty:
        return "There are no sessions."
    said = []
    for protocol, of in sorted(sessions.groupby("protocol"), key=lambda item: (item[0] == PRIMARY, str(item[0]))):
        each = of.groupby("participant").size()
        windows = of["windows_complete"]
        exo = " or ".join(sorted(of["exo"].dropna().unique()))
        machine = f", {exo} exoskeleton" if exo else ""
        said.append(
            f"{protocol}: {_count(len(of), 'session', 'sessions')} of {_count(len(each), 'person', 'people')} "
            f"({_span(each)} each), {_span(windows)} complete windows per session{machine}"
        )
    arms, rigs = (" and ".join(sorted(sessions[name].dropna().unique())) for name in ("side", "rig"))
    place = f" Arm: {arms or 'not stated'}; machine: {rigs or 'not stated'}."
    pitch = data.pitch_mm
    screen = (
        f" A pixel of the screen measured {pitch:.3f} mm."
        if pitch is not None
        else " Not all screens had the same calibration: deviations are given in pixels."
    )
    return f"{'. '.join(said)}.{place}{screen}"


def _touches(data: StudyData) -> str:
    recorded, kept = len(data.tables.touches), len(data.touches)
    return (
        f"Of {_count(recorded, 'recorded touch', 'recorded touches')} {kept} are used. A touch is used if the task "
        "accepted it in a window that ran to its end; of a repeated window only the last complete attempt is used. "
        "Deviation is the distance between contact and target centre. Its logarithm is analysed, with half a pixel as "
        "the smallest value."
    )


def _span(values) -> str:
    low, high = int(values.min()), int(values.max())
    return str(low) if low == high else f"{low} to {high}"


def _count(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"


def provenance(data: StudyData) -> list[tuple[str, str, str]]:
    """Return kind, version or hash, and number of sessions of software and files.

    Hashes are those of the files as used.
    """
    sessions, rows = data.tables.sessions, list[tuple[str, str, str]]()
    for column, words in (
        ("software", "software"),
        ("protocol_sha256", "protocol file"),
        ("calibration_sha256", "machine's calibration"),
    ):
        counts = sessions[column].fillna("not stated").value_counts(sort=False)
        rows += [(words, str(value), str(count)) for value, count in sorted(counts.items())]
    return rows

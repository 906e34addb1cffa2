"""Chapter on the effort of the muscles, from EMG."""

from collections.abc import Iterator

from exograv.report.style.page import Block, Table, Text
from exograv.study.measures.emg_amplitude import LOW_HZ, NOTCH_WIDTH_HZ
from exograv.study.measures.emg_effort import MuscleEffort
from exograv.study.measures.study_data import PRIMARY, StudyData
from exograv.study.statistics.findings import Interval

from .results import number

SEALED_EFFORT = "EMG is not shown while groups are sealed, because the conditions of a person may reveal the group."


def effort_blocks(effort: MuscleEffort, data: StudyData) -> Iterator[Block]:
    """Yield the content of the chapter."""
    if data.is_sealed:
        yield SEALED_EFFORT
        return
    yield Text(_method(effort, data))
    if effort.paired is not None:
        found = effort.paired
        yield Text(
            f"Effort in weightless windows ({effort.weightless_windows}) divided by that at 1 g "
            f"({effort.earth_windows}), {found.people} people: {_ratio(found.ratio, found.interval)}, {found.text}. "
            f"{found.sentence}",
            "strong",
        )
        yield Table(("channel", "ratio"), [(name, number(ratio)) for name, ratio in effort.by_channel.items()])
        yield Table(("participant", "ratio"), [(code, number(ratio)) for code, ratio in effort.by_person.items()])
    if effort.groups is not None:
        found, (first, second) = effort.groups, effort.groups.names
        yield Text(
            f"Effort in {PRIMARY} sessions, {first} divided by {second}: {_ratio(found.ratio, found.interval)}, "
            f"{found.test.text}. {found.test.sentence}"
        )
    yield from effort.left_out


def _method(effort: MuscleEffort, data: StudyData) -> str:
    lines = sorted({one.power_line_Hz for one in data.settings.streams.values() if one.power_line_Hz})
    notch = " and ".join(f"{line:g} Hz" for line in lines)
    mains = f"notches of {NOTCH_WIDTH_HZ:g} Hz at multiples of {notch}" if lines else "no notch, as no mains are stated"
    return (
        f"EMG of {', '.join(effort.channels) or 'no channel'}: high-pass {LOW_HZ:g} Hz without delay, {mains}, "
        "rectified; mean per window, divided by that of the reference contraction. The test compares one logarithm per "
        "person; it assumes that a person's difference is as probable with either sign if the condition has no effect."
    )


def _ratio(value: float, interval: Interval) -> str:
    if interval.low is None or interval.high is None:
        return f"{number(value)}, without a bounded {100 * interval.level:g} % interval"
    return f"{number(value)} ({100 * interval.level:g} % interval {number(interval.low)} to {number(interval.high)})"

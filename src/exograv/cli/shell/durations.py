"""Usual durations of commands, from their options.

The figures are for the twin, the default machine and two cores that have nothing else to do. They are rough: a busy or
slow computer takes several times as long.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

Seconds = Callable[[Any], float | None]
"""Function that returns the usual duration of a command with these options [s]; None if the options do not determine
it."""

SILENT_BELOW_S = 2.0
"""Shortest duration that is announced [s]."""

BUSY_TIMES = 1.5
"""Programs that run or wait, this one included, per processor, from which a computer counts as busy [-]."""

CALIBRATION_S, IDENTIFIED_S_PER_S, FLOATED_S, RUN_REPORT_S = 11.0, 0.03, 3.0, 5.5
"""Calibration of the twin [s]; identification per second of motion; floating and a known weight; report of a run [s].

Sum: the 23 s of a warm `exograv demo` on a quiet computer (docs/results/results.md); shares: the phases of one run. A
machine with seven joints takes about twice as long: 61 against 33 s of CPU time for `demo`.
"""

WINDOW_S, REST_S, VERIFIED_S, CHECKED_S, WEIGHED_S, ATTEMPTS_S = 2.5, 16.0, 10.0, 8.0, 11.0, 17.0
"""A window of a session; a rest that is simulated; a verification; a check; a weighing; the attempts of a search for
support [s].

The last follows from the 27 to 34 s of a whole `run support-level` with 60 attempts.
"""

JOINTS = 4
"""Joints of the machine for which the other figures are."""

BUS_TEST_S, BUS_CALIBRATION_S, BUS_START_S = 12.0, 13.0, 3.5
"""Simulated drives in another process: bring-up, calibration and start of a live run, per joint [s].

Sources: 85 and 92 s of `rig test` and `rig calibrate --simulate` with seven joints on a quiet computer.
"""

ACCEPTED_S = 480.0
"""Acceptance on simulated drives that wait [s]: 395 s of motion, and the preparation of seven flights."""

TIMING_S = 20.0
"""Timing test of the computer in a self-test, which no faster computer shortens [s]."""

BUS_WAITS = 0.2
"""Growth of the duration of a live run on simulated drives that wait, per joint beyond `JOINTS` [-]: 75 s for 46 s."""

STAGE_0_S, STREAM_S, METHOD_S = 20.0, 8.0, 6.0
"""Benchmark of methods: per machine, per wearer, and per method and wearer (median) [s]."""

SCENARIO_S, FAULT_PERSON_S, STRIKE_S = 0.5, 40.0, 60.0
"""Fault campaign: one scenario, preparation of one person, one strike of each kind on a live run [s]."""

CELLS_S = 16.0
"""Process faults: one session with its cells, from its start to the end of all its processes [s]."""

SESSION_S, FLIGHT_S = 1.9, 10.5
"""Example study: one session before the flight, and one flight, on one core [s].

Ratio of the two by CPU time; sum by the 2.0 min of `study example --participants 6,0` (docs/howto/study.md).
"""

FLOWN_SESSION_S = 90.0
"""Simulated study: one session in a machine [s]."""

REPORT_S, REPORT_S_PER_MB, EXPORT_S_PER_MB = 25.0, 0.05, 0.25
"""Report of a study: figures and page; reading of its recordings, and their export [s, s/MB].

The first follows from the CPU time of a report on five sessions, 34 s on a busy computer; the last from that of an
export of eight sessions with 129 MB, 37 s. The second is an estimate over a size extrapolated from ten sessions.
"""


def _prepared(options: Any) -> float:
    return 3.0 if getattr(options, "calibration", None) else CALIBRATION_S


def _demo(options: Any) -> float:
    return _by_joints(options) * (_prepared(options) + _moved(options) + FLOATED_S + RUN_REPORT_S)


def _by_joints(options: Any) -> float:
    """Growth of the duration of a run with the joints beyond `JOINTS` [-]."""
    return max(_joints(options) / JOINTS, 1.0)


def _moved(options: Any) -> float:
    return options.seconds if options.realtime else 2.0 + IDENTIFIED_S_PER_S * options.seconds


def _joints(options: Any) -> int:
    """Return the number of joints of the machine."""
    from exograv.errors import ExogravError
    from exograv.model.description import load_rig

    try:
        return len(load_rig(options.rig, options.side).joints)
    except ExogravError:  # The command itself refuses the machine, with all its reasons.
        return JOINTS


def _rig_test(options: Any) -> float | None:
    return BUS_TEST_S * _joints(options) if options.simulate else None


def _calibrate(options: Any) -> float | None:
    if options.drives and not options.simulate:
        return None
    per_joint = BUS_CALIBRATION_S if options.simulate else CALIBRATION_S / JOINTS
    return per_joint * _joints(options) * (0.3 if options.recheck else 1.0)


def _self_test(options: Any) -> float | None:
    if options.drives and not options.simulate:
        return None
    return TIMING_S + (14.0 if options.simulate else 25.0 if options.worn else 5.0)


def _accept(options: Any) -> float | None:
    return ACCEPTED_S * (1.0 + BUS_WAITS * max(_joints(options) - JOINTS, 0)) if options.simulate else None


def _live(options: Any) -> float:
    if options.participant is not None:
        options = replace(options, identify_s=_stored_arm_s())
    if options.waits:
        joints = _joints(options)
        return options.loop_s * (1.0 + BUS_WAITS * max(joints - JOINTS, 0)) + BUS_START_S * joints
    return options.loop_s + (10.0 if options.is_on_drives or options.identify_s else 35.0)


def _stored_arm_s() -> float:
    """Duration of the motion that checks a stored arm [s]."""
    from exograv.procedures.identification.warm_start import FROM_FILE_S

    return FROM_FILE_S


def _verify(options: Any) -> float:
    if options.is_on_drives:
        return (60.0 if options.participant is None else _stored_arm_s()) + 138.0 + 30.0
    return _prepared(options) + VERIFIED_S


def _weigh(options: Any) -> float | None:
    # On drives the operator puts the weights into their places.
    return None if options.is_on_drives else _prepared(options) + WEIGHED_S


def _repeat(options: Any) -> float | None:
    # On drives the length of the path and the person decide.
    return None if options.is_on_drives else CALIBRATION_S + 3.0 + options.repetitions / options.speed


def _assist(options: Any) -> float | None:
    return None if options.is_on_drives else CALIBRATION_S + 20.0  # On drives the person's attempts decide.


def _support_level(options: Any) -> float | None:
    if options.recording:
        return 3.0
    return None if options.is_on_drives else CALIBRATION_S + 4.0 + ATTEMPTS_S


def _train(options: Any) -> float | None:
    if options.is_on_drives:  # A session with a person; the protocol states its duration.
        return None
    from exograv.errors import ConfigError
    from exograv.task.protocol import load_protocol

    try:
        windows = options.windows or load_protocol(options.protocol).settings.windows.count
    except ConfigError:  # The command itself refuses the protocol, with all its reasons.
        windows = options.windows or 0
    verified, checked = (windows // every if every else 0 for every in (options.verify_every, options.check_every))
    checked += windows if options.learn_in_rests else 0
    rests = windows if options.whole_rests else 0
    return _prepared(options) + 20.0 + WINDOW_S * windows + REST_S * rests + VERIFIED_S * verified + CHECKED_S * checked


def _transparency(options: Any) -> float:
    count = options.machines * (2 if options.rig is None else 1)
    return 90.0 * count * (2.0 if options.movement == "recorded" else 1.0)


def _benchmark(options: Any) -> float:
    places = len(options.levels) * len(options.profiles)
    wearers = places * (options.wearers + options.streams) * (10 if options.break_down else 1)
    seconds = STAGE_0_S * wearers + STREAM_S * wearers + METHOD_S * wearers * len(options.methods)
    return seconds / options.processes


def _process_faults(options: Any) -> float:
    from exograv.campaigns.process_faults.sessions import sessions_of

    return FAULT_PERSON_S + CELLS_S * len(sessions_of(options.planned))


def _faults(options: Any) -> float:
    if options.replay is not None:
        return FAULT_PERSON_S + SCENARIO_S
    slower = 10.0 if options.through else 1.0
    flown = options.scenarios * SCENARIO_S * slower / (options.processes or os.cpu_count() or 1)
    return flown + FAULT_PERSON_S * options.persons + (0.0 if options.through else STRIKE_S * options.strikes)


def _sessions(options: Any) -> int:
    (trained, untrained), (trainings, familiarisations) = options.participants, options.sessions
    return trained * trainings + (trained + untrained) * (familiarisations + 1)


def _example(options: Any) -> float:
    people = sum(options.participants)
    before = sum(count * sessions for count, sessions in zip(options.participants, options.sessions, strict=True))
    # One process per participant, because learning carries over from session to session.
    return 3.0 + (SESSION_S * before + FLIGHT_S * people) / min(os.cpu_count() or 1, people)


def _simulated_study(options: Any) -> float:
    windows = 1.0 if options.windows is None else options.windows / 13.0
    compared = sum(options.participants) * (sum(options.compared) + 1) * len(options.conditions)
    total = FLOWN_SESSION_S * windows * (_sessions(options) + compared) / options.processes
    return total * (1 + 6 * options.sensitivity + 4 * options.ablate)


def _power(options: Any) -> float:
    return 3.0 + 2e-6 * options.studies * options.n_max * (4.0 if options.pilot else 1.0) * 10.0


def _by_size(options: Any, seconds_per_MB: float, *names: str) -> float | None:
    """Duration by the size of the first of these files that exists."""
    for name in names:
        path = getattr(options, name, None)
        for one in path if isinstance(path, tuple) else (path,):
            if one is not None and one.exists():
                return 1.0 + seconds_per_MB * _bytes_of(one) / 1e6
    return None


def _bytes_of(path: Path) -> int:
    """Size of a file, or of all recordings in a folder."""
    inside = (Path(folder, name) for folder, _, names in os.walk(path) for name in names if name.endswith(".mcap"))
    total = 0
    for file in (path,) if path.is_file() else inside:
        # Another command may remove a file or rename a folder meanwhile; an estimate must not end this command.
        with suppress(OSError):
            total += file.stat().st_size
    return total


DURATIONS: dict[str, Seconds] = {
    "demo": _demo,
    "doctor": lambda options: 3.0 + (options.loop or 0.0),
    "report": lambda options: _by_size(options, 0.15, "recording"),
    "rig check": lambda _: 6.0,
    "rig test": _rig_test,
    "rig calibrate": _calibrate,
    "rig self-test": _self_test,
    "rig accept": _accept,
    "rig motion": lambda options: 15.0 + min(options.seconds, 25.0 * (options.starts + 1)),
    "twin fit": lambda options: _by_size(options, 0.5, "recordings"),
    "twin compare": lambda options: 4.0 + 0.15 * options.seconds,
    "arm identify": lambda options: _by_joints(options) * (_prepared(options) + _moved(options) + RUN_REPORT_S),
    "arm identify-log": lambda options: _by_size(options, 4.0, "log"),
    "arm weigh": _weigh,
    "arm verify": _verify,
    "run live": _live,
    "run train": _train,
    "run assist": _assist,
    "run teach": lambda options: None if options.is_on_drives else CALIBRATION_S + 3.0,
    "run repeat": _repeat,
    "run mirror": lambda options: None if options.is_on_drives else CALIBRATION_S + 30.0 + 0.5 * options.seconds,
    "run support-level": _support_level,
    "study add": lambda options: _by_size(options, 0.1, "files"),
    "study status": lambda options: 3.0 if not options.remake else _by_size(options, 0.1, "study"),
    "study report": lambda options: REPORT_S + (_by_size(options, REPORT_S_PER_MB, "study") or 0.0),
    "study export": lambda options: _by_size(options, EXPORT_S_PER_MB, "study"),
    "study example": _example,
    "study power": _power,
    "study simulate": _simulated_study,
    "data replay": lambda options: _by_size(options, 0.4, "file"),
    "data streams": lambda options: options.seconds if options.record else 3.0,
    "data sync": lambda options: _by_size(options, 0.1, "file"),
    "dev benchmark-identification": _benchmark,
    "dev faults": _faults,
    "dev process-faults": _process_faults,
    "dev transparency": _transparency,
    "dev validate-participant": lambda options: 15.0 * options.people,
}
"""Commands that usually take longer than two seconds and end by themselves. A sweep states its own costs (`--plan`)."""


def duration_sentence(path: str, options: Any) -> str:
    """Return a sentence on the usual duration; empty if it is short or not known."""
    seconds = DURATIONS[path](options) if path in DURATIONS else None
    if seconds is None or seconds < SILENT_BELOW_S:
        return ""
    return f"exograv {path} usually takes about {in_words(seconds)} with these options.{_busy_sentence()}"


def _busy_sentence() -> str:
    """Return a sentence on a computer that other programs keep busy; empty if they do not, or if it is not known."""
    try:
        load, processors = os.getloadavg()[0], os.cpu_count() or 1
    except (AttributeError, OSError):  # Windows has no load average.
        return ""
    times = (load + 1.0) / processors
    if times < BUSY_TIMES:
        return ""
    return f" Other programs keep this computer busy (load {load:.1f}): it may take {times:.0f} times as long."


def in_words(seconds: float) -> str:
    """Return a duration in the unit that suits its size."""
    for limit, unit, size in ((100.0, "s", 1.0), (5400.0, "min", 60.0), (172_800.0, "h", 3600.0)):
        if seconds < limit:
            value = seconds / size
            return f"{value:.0f} {unit}" if value >= 3.0 or size == 1.0 else f"{value:.1f} {unit}"
    return f"{seconds / 86_400:.0f} days"

"""Command line `exograv`. Each command imports the rooms that it needs, because `--help` must not wait for them."""

import difflib
import io
import os
import shutil
import signal
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import tyro

from exograv import __version__
from exograv.cli.machine.accept import run_accept_command
from exograv.cli.machine.calibrate import run_calibrate_command
from exograv.cli.machine.check_rig import run_check_rig
from exograv.cli.machine.design_motion import run_design_motion
from exograv.cli.machine.doctor import run_doctor
from exograv.cli.machine.drive_sim import run_drive_sim_command
from exograv.cli.machine.export_urdf import run_export_command
from exograv.cli.machine.live import run_live_command
from exograv.cli.machine.new_rig import run_new_rig
from exograv.cli.machine.next_step import run_next_command
from exograv.cli.machine.rig_test import run_rig_test_command
from exograv.cli.machine.rigs import run_rigs
from exograv.cli.machine.self_test import run_self_test_command
from exograv.cli.person.aircraft import run_aircraft_command
from exograv.cli.person.assist import run_assist_command
from exograv.cli.person.console import run_console_command
from exograv.cli.person.demo import run_demo_command, run_identify_command
from exograv.cli.person.guided import run_mirror_command, run_repeat_command, run_teach_command
from exograv.cli.person.support_level import run_support_level_command
from exograv.cli.person.train import run_train_command
from exograv.cli.person.verify import run_verify_command
from exograv.cli.person.weigh import run_weigh_command
from exograv.cli.recordings.identify_log import run_identify_log
from exograv.cli.recordings.replay import run_replay_command
from exograv.cli.recordings.report import run_report
from exograv.cli.recordings.streams import run_streams
from exograv.cli.recordings.sync import run_sync
from exograv.cli.recordings.view import run_view_command
from exograv.cli.shell.base_options import Common, refuse_unwritable_json, write_json
from exograv.cli.shell.command import Action, checked_parts, command_class, estimate
from exograv.cli.shell.durations import duration_sentence
from exograv.cli.shell.end_signals import EndSignals
from exograv.cli.shell.needs import refuse_missing
from exograv.cli.shell.spellings import present_spelling, value_of
from exograv.cli.simulation.amplifier import run_amplifier_command
from exograv.cli.simulation.benchmark_identification import run_benchmark_identification
from exograv.cli.simulation.faults import run_faults_command
from exograv.cli.simulation.process_faults import run_process_faults_command
from exograv.cli.simulation.simulate_study import run_simulate_study
from exograv.cli.simulation.stimulus import run_stimulus_command
from exograv.cli.simulation.sweep import run_sweep_command
from exograv.cli.simulation.transparency import run_transparency_command
from exograv.cli.simulation.validate_participant import run_validate_participant
from exograv.cli.twin.compare import run_twin_compare
from exograv.cli.twin.fit import run_twin_fit
from exograv.errors import ConfigError, ExogravError
from exograv.extras import missing_package
from exograv.files import NO_ROOM
from exograv.results import json_value

from .study import COMMANDS as STUDY_COMMANDS

Commands = dict[str, Action]


class Group(NamedTuple):
    """Commands that share their first word."""

    about: str
    commands: Commands


START: Commands = {
    "demo": run_demo_command,
    "doctor": run_doctor,
    "next": run_next_command,
    "rigs": run_rigs,
    "report": run_report,
}
"""Commands without a group."""

GROUPS: dict[str, Group] = {
    "rig": Group(
        "A machine: describe, check, bring up, calibrate, and test it.",
        {
            "new": run_new_rig,
            "check": run_check_rig,
            "test": run_rig_test_command,
            "calibrate": run_calibrate_command,
            "self-test": run_self_test_command,
            "accept": run_accept_command,
            "motion": run_design_motion,
            "export": run_export_command,
        },
    ),
    "twin": Group(
        "The twin of your own machine: fit it to recordings, and compare it with later ones.",
        {"fit": run_twin_fit, "compare": run_twin_compare},
    ),
    "arm": Group(
        "An arm in a machine: identify, weigh, and verify it.",
        {
            "identify": run_identify_command,
            "identify-log": run_identify_log,
            "weigh": run_weigh_command,
            "verify": run_verify_command,
        },
    ),
    "run": Group(
        "A session: float an arm, train, and assist.",
        {
            "live": run_live_command,
            "console": run_console_command,
            "train": run_train_command,
            "assist": run_assist_command,
            "teach": run_teach_command,
            "repeat": run_repeat_command,
            "mirror": run_mirror_command,
            "support-level": run_support_level_command,
        },
    ),
    "study": Group(
        "A study: from recordings of sessions to findings.", {**STUDY_COMMANDS, "simulate": run_simulate_study}
    ),
    "data": Group(
        "Recordings and streams: view, replay, record, and synchronise.",
        {
            "view": run_view_command,
            "replay": run_replay_command,
            "streams": run_streams,
            "sync": run_sync,
            "aircraft": run_aircraft_command,
        },
    ),
    "dev": Group(
        "Campaigns and tools for developers.",
        {
            "benchmark-identification": run_benchmark_identification,
            "sweep": run_sweep_command,
            "faults": run_faults_command,
            "process-faults": run_process_faults_command,
            "transparency": run_transparency_command,
            "validate-participant": run_validate_participant,
            "drive-sim": run_drive_sim_command,
            "stimulus": run_stimulus_command,
            "amplifier": run_amplifier_command,
        },
    ),
}
"""Commands by group; the signature of a function names the classes of its options."""

FORMER_NAMES = {
    "new-rig": ("rig", "new"),
    "check-rig": ("rig", "check"),
    "rig-test": ("rig", "test"),
    "design-motion": ("rig", "motion"),
    "export-urdf": ("rig", "export"),
    "simulate-study": ("study", "simulate"),
}
"""Names of commands before there were groups. They still work, as does every command without the word of its group."""

FIRST_STEPS = (
    ("exograv doctor", "check this computer", "some seconds"),
    ("exograv demo", "identify and float a simulated arm, and write a report", "half a minute"),
    ("exograv rigs", "list the machines that come with exograv", "a second"),
)


def main() -> None:
    """Run the `exograv` command."""
    # Our matrices are small: on a busy computer the threads of OpenBLAS wait milliseconds for each other, and a demo
    # takes twice as long. NumPy reads the variable at its import, so it must be set here.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with EndSignals() as signals:
        _run_and_report(signals)


def _run_and_report(signals: EndSignals) -> None:
    """Run the command; turn its errors into a sentence and an exit status."""
    try:
        _run_as_asked()
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader of a pipe such as `exograv --help | head` has enough. Python would complain once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(141)
    except ExogravError as error:
        print(f"exograv: {error}", file=sys.stderr)
        sys.exit(1)
    except OSError as error:
        if error.errno not in NO_ROOM:
            raise
        print(
            f"exograv: {error.filename or 'A file'} cannot be written: {error.strerror}. Free space there (temporary "
            f"files are in {tempfile.gettempdir()}), then run the same command again. Complete files are unchanged.",
            file=sys.stderr,
        )
        sys.exit(1)
    except (KeyboardInterrupt, ImportError) as error:
        if isinstance(error, ModuleNotFoundError) and (missing := missing_package(error)) is not None:
            print(f"exograv: {missing}", file=sys.stderr)
            sys.exit(1)
        if not was_keyboard(error):
            raise
        by = "the keyboard" if signals.came is None else f"the signal {signals.came.name}"
        print(f"\nexograv: stopped by {by}.{kept_recording()}", file=sys.stderr)
        sys.exit(128 + (signals.came or signal.SIGINT))


def kept_recording() -> str:
    """Sentence on the recording that this process began last; empty if there is none."""
    writer = sys.modules.get("exograv.recording.writer")
    begun = [path for path in (writer.BEGUN if writer else ()) if path.is_file()]
    return f" The recording until now is kept: {begun[-1]}" if begun else ""


def _run_as_asked() -> None:
    words = sys.argv[1:]
    if words == ["--version"]:
        print(f"exograv {__version__}")
        return
    try:
        path, rest = resolved(words)
    except UnknownCommandError as error:
        print(f"exograv: {error}", file=sys.stderr)
        sys.exit(2)
    if path in GROUPS:
        print(group_help(path))
        return
    if not path:
        print(overview())
        return
    action = ACTIONS[path]
    command: Common = parsed(path, rest)
    parts = checked_parts(action, command)
    refuse_missing(path, command)
    if command.write_settings is not None:
        from exograv.cli.shell.settings import write_settings

        write_settings(command.write_settings, path, command)
    if command.json is not None:
        refuse_unwritable_json(command.json)
    estimate.set(duration_sentence(path, command))
    result = json_value(action(**parts))
    if command.json is not None:
        write_json(command.json, result)
    # A failed check ends with status 1, so that a script does not continue.
    if not result.get("ok", True):
        sys.exit(1)


def parsed(path: str, words: list[str]) -> Any:
    """Read the options of a command from the words of the command line, and from the settings file that they name.

    Raises:
        ConfigError: The settings file cannot be used.
    """
    kind = command_class(ACTIONS[path])
    words, defaults = present_spelling(kind, words), None
    file = value_of("--settings", words)
    if file is not None:
        from exograv.cli.shell.settings import with_settings

        defaults = with_settings(Path(file), path, ACTIONS, words)
    config = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.SuppressFixed)
    framed = io.StringIO()
    try:
        with heeded_no_color(), wrapped_output() if set(words) & set(HELP) else nullcontext(), redirect_stderr(framed):
            return tyro.cli(kind, prog=f"exograv {path}", args=words, default=defaults, config=config)
    except SystemExit as end:
        if end.code:
            from exograv.cli.shell.wrong_option import missing_words, wrong_word

            sentence = wrong_word(path, words, ACTIONS) or missing_words(path, words, ACTIONS, defaults)
            print(f"exograv: {sentence}" if sentence else framed.getvalue(), file=sys.stderr)
        raise


ACTIONS: Commands = START | {
    f"{word} {name}": action for word, group in GROUPS.items() for name, action in group.commands.items()
}
"""Every command by its full name."""

HELP = ("-h", "--help")

NARROW = 60
"""Terminal width below which the description of a command is wrapped too [columns]."""


SHORTEST_BEGINNING = 3
"""Number of characters from which a word may be the beginning of a command."""


class UnknownCommandError(ConfigError):
    """Word on the command line that names no command."""


def resolved(words: list[str]) -> tuple[str, list[str]]:
    """Split the command line into the name of a command or group and its options; empty name for the overview.

    A command is also found without the word of its group, and by its former name.

    Raises:
        UnknownCommandError: No command has this name.
    """
    if not words or words[0] in (*HELP, "help"):
        return "", words
    first, rest = words[0], words[1:]
    if first in FORMER_NAMES:
        return " ".join(FORMER_NAMES[first]), rest
    if first in START:
        return first, rest
    if first not in GROUPS:
        for word, group in GROUPS.items():
            if first in group.commands and word != "study":
                return f"{word} {first}", rest
        raise UnknownCommandError(
            _unknown(first, [*START, *GROUPS, *(name for g in GROUPS.values() for name in g.commands)])
        )
    if not rest or rest[0] in (*HELP, "help"):
        return first, rest
    if rest[0] not in GROUPS[first].commands:
        raise UnknownCommandError(
            _unknown(f"{first} {rest[0]}", [f"{first} {name}" for name in GROUPS[first].commands])
        )
    return f"{first} {rest[0]}", rest[1:]


def _unknown(name: str, known: list[str]) -> str:
    begun = [one for one in dict.fromkeys(known) if one.startswith(name)] if len(name) >= SHORTEST_BEGINNING else []
    near = begun[:3] or difflib.get_close_matches(name, dict.fromkeys(known), n=3, cutoff=0.6)
    full = [next((path for path in ACTIONS if path.split()[-1] == one), one) for one in near]
    meant = f" Did you mean: {', '.join(dict.fromkeys(f'exograv {one}' for one in full))}?" if near else ""
    return f"There is no command '{name}'.{meant} `exograv --help` lists all commands."


def overview() -> str:
    """Text of `exograv` without a command: first steps, and all commands by group."""
    about = "exograv takes away the weight of the arm inside an exoskeleton. Research software, not a medical device."
    lines = [*_wrapped(about, 0), "", "First steps:"]
    for command, purpose, duration in FIRST_STEPS:
        lines += _entry(command, f"{purpose} ({duration})", 2, 19)
    lines += ["", *_wrapped("Commands (exograv COMMAND --help shows the options):", 0), f"  {', '.join(START)}", ""]
    for word, group in GROUPS.items():
        lines += [*_entry(word, group.about, 2, 9), *_wrapped(", ".join(group.commands), 9), ""]
    return "\n".join([*lines, "Documentation: docs/index.md"])


def group_help(word: str) -> str:
    """Text of a group: each command with the first sentence of its description."""
    group = GROUPS[word]
    width = max(map(len, group.commands)) + 2
    lines = [*_wrapped(group.about, 0), ""]
    for name, action in group.commands.items():
        lines += _entry(name, (action.__doc__ or "").strip().splitlines()[0], 4, 4 + width)
    return "\n".join([*lines, "", *_wrapped(f"exograv {word} COMMAND --help shows the options.", 0)])


def _entry(name: str, about: str, indent: int, column: int) -> list[str]:
    """Lines of a name with its description in a column; on a narrow terminal the description is below the name."""
    if shutil.get_terminal_size().columns < column + 40:
        return [" " * indent + name, *_wrapped(about, indent + 4)]
    first, *more = _wrapped(about, column)
    return [f"{' ' * indent}{name}".ljust(column) + first.strip(), *more]


@contextmanager
def heeded_no_color() -> Iterator[None]:
    """Parse without colours if NO_COLOR is set. tyro does not read it, but writes no colours if TERM is dumb."""
    before = os.environ.get("TERM")
    if not os.environ.get("NO_COLOR") or before is None:
        yield
        return
    os.environ["TERM"] = "dumb"
    try:
        yield
    finally:
        os.environ["TERM"] = before


@contextmanager
def wrapped_output() -> Iterator[None]:
    """Wrap long lines of a help text on a narrow terminal: tyro wraps the options, but not the description."""
    if shutil.get_terminal_size().columns >= NARROW:
        yield
        return
    text = io.StringIO()
    try:
        with redirect_stdout(text):
            yield
    finally:
        for line in text.getvalue().splitlines():
            print("\n".join(_wrapped(line, 0)) if line[:1].isalnum() else line)


def _wrapped(text: str, indent: int) -> list[str]:
    columns = max(shutil.get_terminal_size().columns, indent + 20)
    return textwrap.wrap(
        text, columns, break_on_hyphens=False, initial_indent=" " * indent, subsequent_indent=" " * indent
    )


def was_keyboard(error: BaseException | None) -> bool:
    """Return True if Ctrl-C caused the error: the import of a compiled module turns it into an `ImportError`."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None

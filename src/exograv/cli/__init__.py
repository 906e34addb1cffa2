"""Command line `exograv`. Each command imports the rooms that it needs, because `--help` must not wait for them."""

import os
import sys
from functools import reduce
from operator import or_
from typing import Annotated, Any

import tyro

from exograv import __version__
from exograv.cli.machine.calibrate import run_calibrate_command
from exograv.cli.machine.check_rig import run_check_rig
from exograv.cli.machine.design_motion import run_design_motion
from exograv.cli.machine.doctor import run_doctor
from exograv.cli.machine.drive_sim import run_drive_sim_command
from exograv.cli.machine.export_urdf import run_export_command
from exograv.cli.machine.live import run_live_command
from exograv.cli.machine.new_rig import run_new_rig
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
from exograv.cli.shell.base_options import Common, refuse_unwritable, write_json
from exograv.cli.shell.command import Action, act, command_class
from exograv.cli.simulation.benchmark_identification import run_benchmark_identification
from exograv.cli.simulation.faults import run_faults_command
from exograv.cli.simulation.simulate_study import run_simulate_study
from exograv.cli.simulation.sweep import run_sweep_command
from exograv.cli.simulation.transparency import run_transparency_command
from exograv.cli.simulation.validate_participant import run_validate_participant
from exograv.errors import ExogravError
from exograv.extras import missing_package

from .study import COMMANDS as STUDY_COMMANDS

Commands = dict[str, Action]

COMMANDS: Commands = {
    "demo": run_demo_command,
    "identify": run_identify_command,
    "calibrate": run_calibrate_command,
    "weigh": run_weigh_command,
    "train": run_train_command,
    "simulate-study": run_simulate_study,
    "verify": run_verify_command,
    "transparency": run_transparency_command,
    "validate-participant": run_validate_participant,
    "identify-log": run_identify_log,
    "export-urdf": run_export_command,
    "report": run_report,
    "replay": run_replay_command,
    "rigs": run_rigs,
    "new-rig": run_new_rig,
    "check-rig": run_check_rig,
    "design-motion": run_design_motion,
    "doctor": run_doctor,
    "self-test": run_self_test_command,
    "live": run_live_command,
    "console": run_console_command,
    "drive-sim": run_drive_sim_command,
    "rig-test": run_rig_test_command,
    "streams": run_streams,
    "sync": run_sync,
    "faults": run_faults_command,
    "support-level": run_support_level_command,
    "teach": run_teach_command,
    "repeat": run_repeat_command,
    "mirror": run_mirror_command,
    "assist": run_assist_command,
    "aircraft": run_aircraft_command,
    "benchmark-identification": run_benchmark_identification,
    "sweep": run_sweep_command,
}
"""Function of each word on the command line; its signature names the classes of its options."""

GROUPS = {"study": ("Turn a folder of recordings into findings.", STUDY_COMMANDS)}
"""Groups of commands by their first word: description and commands."""


def main() -> None:
    """Run the `exograv` command."""
    # Our matrices are small: on a busy computer the threads of OpenBLAS wait milliseconds for each other, and a demo
    # takes twice as long. NumPy reads the variable at its import, so it must be set here.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        _run_as_asked()
    except ExogravError as error:
        print(f"exograv: {error}", file=sys.stderr)
        sys.exit(1)
    except (KeyboardInterrupt, ImportError) as error:
        if isinstance(error, ModuleNotFoundError) and (missing := missing_package(error)) is not None:
            print(f"exograv: {missing}", file=sys.stderr)
            sys.exit(1)
        if not was_keyboard(error):
            raise
        print("\nexograv: stopped by the keyboard; the recording until now is kept.", file=sys.stderr)
        sys.exit(130)


def _run_as_asked() -> None:
    if sys.argv[1:] == ["--version"]:
        print(f"exograv {__version__}")
        return
    command: Common = tyro.cli(
        _one_of(COMMANDS, GROUPS),
        prog="exograv",
        description="Take the weight off an arm inside an exoskeleton. Research software, not a medical device.",
        config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.SuppressFixed),
    )
    if command.json is not None:
        refuse_unwritable(command.json)
    result = run(command)
    if command.json is not None:
        write_json(command.json, result)
    # A failed check ends with status 1, so that a script does not continue.
    if not result.get("ok", True):
        sys.exit(1)


def _one_of(commands: Commands, groups: dict[str, tuple[str, Commands]]) -> Any:
    options = [Annotated[command_class(action), tyro.conf.subcommand(name)] for name, action in commands.items()]
    for name, (about, members) in groups.items():
        options.append(Annotated[_one_of(members, {}), tyro.conf.subcommand(name, description=about)])
    return reduce(or_, options)


def was_keyboard(error: BaseException | None) -> bool:
    """Return True if Ctrl-C caused the error: the import of a compiled module turns it into an `ImportError`."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def run(command: Common) -> dict[str, Any]:
    """Run one command, show its result, and return the object that `--json` writes."""
    actions = [*COMMANDS.values(), *(action for _, members in GROUPS.values() for action in members.values())]
    return act(next(action for action in actions if command_class(action) is type(command)), command)

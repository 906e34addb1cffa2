"""One command per session. Heavy rooms are imported by the command that needs them: `--help` must not wait for them."""

import os
import sys
from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import Annotated, Any

import tyro

from exograv import __version__
from exograv.cli.machine.calibrate import Calibrate, run_calibrate_command
from exograv.cli.machine.check_rig import CheckRig, run_check_rig
from exograv.cli.machine.design_motion import DesignMotion, run_design_motion
from exograv.cli.machine.doctor import Doctor, run_doctor
from exograv.cli.machine.drive_sim import DriveSim, run_drive_sim_command
from exograv.cli.machine.export_urdf import ExportUrdf, run_export_command
from exograv.cli.machine.live import Live, run_live_command
from exograv.cli.machine.new_rig import NewRig, run_new_rig
from exograv.cli.machine.rig_test import RigTest, run_rig_test_command
from exograv.cli.machine.rigs import Rigs, run_rigs
from exograv.cli.machine.self_test import SelfTest, run_self_test_command
from exograv.cli.person.aircraft import Aircraft, run_aircraft_command
from exograv.cli.person.assist import Assist, run_assist_command
from exograv.cli.person.console import Console, run_console_command
from exograv.cli.person.demo import Demo, Identify, run_demo_command
from exograv.cli.person.guided import Mirror, Repeat, Teach, run_mirror_command, run_repeat_command, run_teach_command
from exograv.cli.person.support_level import SupportLevel, run_support_level_command
from exograv.cli.person.train import Train, run_train_command
from exograv.cli.person.verify import Verify, run_verify_command
from exograv.cli.person.weigh import Weigh, run_weigh_command
from exograv.cli.recordings.identify_log import IdentifyLog, run_identify_log
from exograv.cli.recordings.replay import Replay, run_replay_command
from exograv.cli.recordings.report import Report, run_report
from exograv.cli.recordings.streams import Streams, run_streams
from exograv.cli.recordings.sync import Sync, run_sync
from exograv.cli.shell.base_options import Common, refuse_unwritable, write_json
from exograv.cli.simulation.benchmark_identification import BenchmarkIdentification, run_benchmark_identification
from exograv.cli.simulation.faults import Faults, run_faults_command
from exograv.cli.simulation.simulate_study import SimulateStudy, run_simulate_study
from exograv.cli.simulation.sweep import Sweep, run_sweep_command
from exograv.cli.simulation.transparency import Transparency, run_transparency_command
from exograv.cli.simulation.validate_participant import ValidateParticipant, run_validate_participant
from exograv.errors import ExogravError

from .study import COMMANDS as STUDY_COMMANDS

Commands = dict[str, tuple[type[Common], Callable[[Any], dict[str, Any]]]]

COMMANDS: Commands = {
    "demo": (Demo, run_demo_command),
    "identify": (Identify, run_demo_command),
    "calibrate": (Calibrate, run_calibrate_command),
    "weigh": (Weigh, run_weigh_command),
    "train": (Train, run_train_command),
    "simulate-study": (SimulateStudy, run_simulate_study),
    "verify": (Verify, run_verify_command),
    "transparency": (Transparency, run_transparency_command),
    "validate-participant": (ValidateParticipant, run_validate_participant),
    "identify-log": (IdentifyLog, run_identify_log),
    "export-urdf": (ExportUrdf, run_export_command),
    "report": (Report, run_report),
    "replay": (Replay, run_replay_command),
    "rigs": (Rigs, run_rigs),
    "new-rig": (NewRig, run_new_rig),
    "check-rig": (CheckRig, run_check_rig),
    "design-motion": (DesignMotion, run_design_motion),
    "doctor": (Doctor, run_doctor),
    "self-test": (SelfTest, run_self_test_command),
    "live": (Live, run_live_command),
    "console": (Console, run_console_command),
    "drive-sim": (DriveSim, run_drive_sim_command),
    "rig-test": (RigTest, run_rig_test_command),
    "streams": (Streams, run_streams),
    "sync": (Sync, run_sync),
    "faults": (Faults, run_faults_command),
    "support-level": (SupportLevel, run_support_level_command),
    "teach": (Teach, run_teach_command),
    "repeat": (Repeat, run_repeat_command),
    "mirror": (Mirror, run_mirror_command),
    "assist": (Assist, run_assist_command),
    "aircraft": (Aircraft, run_aircraft_command),
    "benchmark-identification": (BenchmarkIdentification, run_benchmark_identification),
    "sweep": (Sweep, run_sweep_command),
}
"""Word on the command line: its options, and what runs them and returns the figures of `--json`."""

GROUPS = {"study": ("From a folder of recordings to findings.", STUDY_COMMANDS)}
"""Words that are followed by another one: what it is all about, and the commands."""

NO_TWIN = (
    "The twin needs MuJoCo, which is not installed: pip install 'exograv[twin]'. A real machine needs none: give "
    "--drives, where the command has it."
)


def main() -> None:
    """Entry point of the `exograv` command."""
    # Our matrices are small: on a busy computer the threads of OpenBLAS wait milliseconds for each other, and a demo
    # takes twice as long. Read when NumPy is imported, so it has to be said here.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        _run_as_asked()
    except ExogravError as error:
        print(f"exograv: {error}", file=sys.stderr)
        sys.exit(1)
    except (KeyboardInterrupt, ImportError) as error:
        if isinstance(error, ModuleNotFoundError) and error.name == "mujoco":
            print(f"exograv: {NO_TWIN}", file=sys.stderr)
            sys.exit(1)
        if not was_keyboard(error):
            raise
        print("\nexograv: stopped by the keyboard; what was recorded so far is kept.", file=sys.stderr)
        sys.exit(130)


def _run_as_asked() -> None:
    if sys.argv[1:] == ["--version"]:
        print(f"exograv {__version__}")
        return
    command: Common = tyro.cli(
        _one_of(COMMANDS, GROUPS),
        prog="exograv",
        description="Take the weight off an arm inside an exoskeleton. Research software, not a medical device.",
        config=(tyro.conf.OmitSubcommandPrefixes,),
    )
    if command.json is not None:
        refuse_unwritable(command.json)
    result = run(command)
    if command.json is not None:
        write_json(command.json, result)
    # The doctor's verdict: a script must not go on where something is missing.
    if not result.get("ok", True):
        sys.exit(1)


def _one_of(commands: Commands, groups: dict[str, tuple[str, Commands]]) -> Any:
    options = [Annotated[kind, tyro.conf.subcommand(name)] for name, (kind, _) in commands.items()]
    for name, (about, members) in groups.items():
        options.append(Annotated[_one_of(members, {}), tyro.conf.subcommand(name, description=about)])
    return reduce(or_, options)


def was_keyboard(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind it: a compiled module that is being imported makes an `ImportError` of it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def run(command: Common) -> dict[str, Any]:
    """Run one command and show its result; returns what `--json` writes."""
    known = [COMMANDS, *(members for _, members in GROUPS.values())]
    return next(action for members in known for kind, action in members.values() if kind is type(command))(command)

"""`exograv next` states what a machine, a person and a session have passed, and names the one command to run now."""

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from tests.docs_scripts import FOLDER, docs_script

from exograv import cli
from exograv.cli.shell.command import command_class, options_of
from exograv.errors import ExogravError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.live.on_drives.connection import not_ready
from exograv.live.on_drives.next_step import NextStep, next_step
from exograv.live.options import NextOptions
from exograv.model.anthropometry import Body
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.participant_session import stored_person
from exograv.rig.drives.settings import Drives, load_drives
from exograv.storage.acceptance_protocol import (
    AcceptanceKey,
    AcceptanceProtocol,
    AcceptanceRecord,
    write_protocol,
)
from exograv.storage.bring_up_sheet import write_sheet
from exograv.storage.calibration_file import identity_of, write_calibration
from exograv.storage.calibration_schema import MeasurementConditions, stored
from exograv.storage.machine_readiness import NEEDED, WITHOUT_DRIVES, WORN
from exograv.storage.participant_file import write_participant
from exograv.storage.participant_schema import Identified, StoredPerson
from exograv.storage.self_test_pass import MachineKey, withdraw_pass, write_pass
from exograv.storage.self_test_step import Step
from exograv.storage.session_checkpoint import SESSION_FILE, KeptSession
from exograv.task.state import RunState, WindowState

RIG = load_rig("recupera_like")
DAY, HOUR = timedelta(days=1), timedelta(hours=1)
FORM = "--body-height M --body-mass KG --sex female"


@dataclass
class Bench:
    """Folder with the files of one machine on drives, in the working folder."""

    drives: Drives
    now: datetime

    def bring_up(self, passes: bool = True) -> None:
        step = Step("nudge", passes, 1.0, 2.0)
        write_sheet(Path("out/rig_test.toml"), RIG, self.drives, [step], "ab", self.now - 3 * DAY, simulated=False)

    def calibrate(self, ago: timedelta = 2 * DAY, friction_ago: timedelta = 3 * HOUR) -> str:
        phi = read_exoskeleton(RIG).phi
        small = np.full(4, 0.001)
        found = Calibration(nominal_machine(RIG, phi), np.zeros(2), small[:2], small, small, 0.01 * np.abs(phi))
        when = MeasurementConditions(
            at_utc=self.now - ago, friction_at_utc=self.now - friction_ago, running_s=300.0, lengths_m={}
        )
        whole = stored(found, identity_of(RIG, self.drives.settings.serial), when, RIG.joints)
        write_calibration(Path("out/calibration.toml"), whole)
        return whole.content_sha256

    def test(self, seal: str, ago: timedelta = timedelta()) -> None:
        write_pass(MachineKey(Path("out/self_test.toml"), RIG, self.drives.settings.serial, seal), self.now - ago)

    def make_ready(self, is_accepted: bool = True) -> None:
        self.bring_up()
        self.test(self.calibrate())
        if is_accepted:
            self.accept()

    def accept(self, state: str = "passed", drives_sha256: str | None = None) -> None:
        at = (self.now - 2 * DAY).replace(microsecond=0)
        key = AcceptanceKey(
            drives_sha256=drives_sha256 or self.drives.sha256, calibration_sha256="", dummy="dummy A", dummy_sha256="",
            code_sha256="", is_simulated=False,
        )  # fmt: skip
        done = AcceptanceRecord.model_validate(
            {"by": "ab", "begun": at, "written": at, "state": state, "aborted_at": "", "versions": {}}
        )
        identity = identity_of(RIG, self.drives.settings.serial)
        write_protocol(Path("out"), AcceptanceProtocol(identity=identity, key=key, done=done, parts=[]))

    def know(self, serial: str) -> None:
        body = Body(1.72, 64.0, "female")
        assembly = assemble(RIG, body)
        x = table_guess(assembly, nominal_machine(RIG, read_exoskeleton(RIG).phi))
        identified = Identified(
            at_utc=self.now - DAY, donnings=2, method="recursive", prior_sha256="", motion="designed", motion_s=60.0,
            calibration_sha256="", outcome="", predicted_left_over_Nm=[], held_out_error_Nm=[], held_out_s=0.0,
        )  # fmt: skip
        person = stored_person(StoredPerson.of("P-07", body), assembly, serial, identified, (x, np.eye(len(x))))
        write_participant(Path("out/participants/P-07.toml"), person)

    def keep(self, number: int, status: str, windows: int) -> None:
        done = tuple(
            WindowState(number=n, attempt=1, epoch=0, opened=0.0, by="clock", closed=22.0, is_complete=True)
            for n in range(1, windows + 1)
        )
        state = RunState(status=status, windows=done)  # type: ignore[arg-type]
        path = Path(f"out/P-07_training_{number:02d}.run.json")
        SESSION_FILE.write(path, KeptSession(options={}, t=0.0, run=state.model_dump_json(), person=None, before={}))
        then = (self.now - 2 * HOUR).timestamp()
        os.utime(path, (then, then))

    def next(self, *, participant: str | None = "P-07", session: int | None = None, simulate: bool = False) -> NextStep:
        options = NextOptions(
            drives=Path("drives.toml"), simulate=simulate, participant=participant, session=session
        )  # fmt: skip
        return next_step(options, Path("out"))


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    now = datetime.now().astimezone()
    return Bench(load_drives(written(Path(), RIG), RIG), now)


def said(step: NextStep) -> dict[str, str]:
    return {check.name: check.found for check in step.checks}


UNTESTED = (
    "The machine is locked: no self-test has passed here. Run `exograv rig self-test --drives drives.toml`, with "
    "nobody in the machine."
)


def nothing(bench: Bench) -> tuple[str, str, str]:
    return (
        "bring-up",
        "out/rig_test.toml is missing: no bring-up of this machine has passed. Bring the machine up first: `exograv "
        "rig test --drives drives.toml --by INITIALS`.",
        "exograv rig test --drives drives.toml --by INITIALS",
    )


def failed_bring_up(bench: Bench) -> tuple[str, str, str]:
    bench.bring_up(passes=False)
    return (
        "bring-up",
        "out/rig_test.toml has steps that failed. Bring the machine up first: `exograv rig test --drives drives.toml "
        "--by INITIALS`.",
        "exograv rig test --drives drives.toml --by INITIALS",
    )


def brought_up(bench: Bench) -> tuple[str, str, str]:
    bench.bring_up()
    return (
        "calibration",
        "out/calibration.toml cannot be read: No such file or directory. Calibrate this machine first (`exograv rig "
        "calibrate --drives drives.toml`), or give its calibration.toml with --calibration.",
        "exograv rig calibrate --drives drives.toml",
    )


def old_calibration(bench: Bench) -> tuple[str, str, str]:
    bench.bring_up()
    bench.calibrate(40 * DAY, 40 * DAY)
    return (
        "calibration",
        "out/calibration.toml is stale: it was measured 40 days ago; 30 days are allowed. Calibrate again: `exograv "
        "rig calibrate --drives drives.toml`.",
        "exograv rig calibrate --drives drives.toml",
    )


def untested(bench: Bench) -> tuple[str, str, str]:
    bench.bring_up()
    bench.calibrate()
    return "self-test", UNTESTED, "exograv rig self-test --drives drives.toml"


def passed_yesterday(bench: Bench) -> tuple[str, str, str]:
    bench.bring_up()
    bench.test(bench.calibrate(), DAY)
    days = f"{bench.now - DAY:%Y-%m-%d}, and today is {bench.now:%Y-%m-%d}"
    return (
        "self-test",
        f"The machine is locked: its self-test passed on {days}. Run `exograv rig self-test --drives drives.toml`, "
        "with nobody in the machine.",
        "exograv rig self-test --drives drives.toml",
    )


def stopped_since(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready()
    withdraw_pass(Path("out/self_test.toml"), "a joint was too fast")
    return (
        "self-test",
        "The machine is locked: since its self-test a fault has stopped it (a joint was too fast). Run `exograv rig "
        "self-test --drives drives.toml`, with nobody in the machine.",
        "exograv rig self-test --drives drives.toml",
    )


ACCEPT = "exograv rig accept --drives drives.toml --by INITIALS"
NOT_ACCEPTED = f"Accept the machine before the first person: `{ACCEPT}`."


def never_accepted(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready(is_accepted=False)
    why = "out/acceptance.toml is missing: this machine was not accepted with a dummy arm."
    return "acceptance", f"{why} {NOT_ACCEPTED}", ACCEPT


def failed_acceptance(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready(is_accepted=False)
    bench.accept("failed")
    return "acceptance", f"out/acceptance.toml says: failed. {NOT_ACCEPTED}", f"{ACCEPT} --resume"


def accepted_with_other_drives(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready(is_accepted=False)
    bench.accept(drives_sha256="other")
    return "acceptance", f"out/acceptance.toml belongs to another drives.toml. {NOT_ACCEPTED}", ACCEPT


def unknown_person(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready()
    return (
        "arm",
        "no file out/participants/P-07.toml: the session identifies the arm for 60 s.",
        f"exograv run train --drives drives.toml --participant P-07 {FORM}",
    )


def known_person(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready()
    bench.know(bench.drives.settings.serial)
    return (
        "arm",
        "identified 2 times, last 24 h ago: the session checks it for 20 s.",
        "exograv run train --drives drives.toml --participant P-07",
    )


def person_of_another_machine(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready()
    bench.know("another")
    return (
        "arm",
        "out/participants/P-07.toml is of another machine: its machine is 'another', this one's is 'simulated'. "
        "Identify the person again: `exograv arm identify --keep FILE`.",
        "exograv arm identify --drives drives.toml --keep out/participants/P-07.toml --code P-07 " + FORM,
    )


def interrupted_session(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready()
    bench.know(bench.drives.settings.serial)
    bench.keep(1, "running", 12)
    return (
        "session",
        "session 1 of 'training' was interrupted; 12 of 31 windows are complete, the last state is 2 h old.",
        "exograv run train --drives drives.toml --participant P-07 --resume",
    )


def finished_session(bench: Bench) -> tuple[str, str, str]:
    bench.make_ready()
    bench.know(bench.drives.settings.serial)
    bench.keep(1, "finished", 31)
    return (
        "session",
        "session 2 of 'training' has not begun.",
        "exograv run train --drives drives.toml --participant P-07 --session 2",
    )


STATES = [
    nothing, failed_bring_up, brought_up, old_calibration, untested, passed_yesterday, stopped_since,
    never_accepted, failed_acceptance, accepted_with_other_drives, unknown_person, known_person,
    person_of_another_machine, interrupted_session, finished_session,
]  # fmt: skip


@pytest.mark.parametrize("state", STATES, ids=lambda one: one.__name__)
def test_each_state_of_the_files_has_its_sentence_and_its_command(
    state: Callable[[Bench], tuple[str, str, str]], bench: Bench
):
    name, sentence, command = state(bench)
    found = bench.next()
    assert said(found)[name] == sentence
    assert found.command == command
    path, words = cli.resolved(found.command.split()[1:])
    assert path in NEEDED
    assert words


def test_no_command_refuses_a_machine_that_was_not_accepted(bench: Bench):
    bench.make_ready(is_accepted=False)
    assert not bench.next().ready
    not_ready(NextOptions(drives=Path("drives.toml")), Path("out"), RIG, "run train", lambda _: None)(bench.drives)


def test_a_ready_machine_says_how_old_everything_is(bench: Bench):
    bench.make_ready()
    found = bench.next(participant=None)
    assert said(found) == {
        "drives": "drives.toml: 4 drives on udp.",
        "motion": "that of rig.toml.",
        "bring-up": f"passed on {bench.now - 3 * DAY:%Y-%m-%d}, 3 days ago, by ab.",
        "calibration": "measured 2 days ago, 30 days are allowed; its friction 3 h ago.",
        "self-test": f"passed today at {bench.now:%H:%M}, with the timing of this computer.",
        "acceptance": "passed 2 days ago with the dummy 'dummy A', by ab.",
    }
    assert found.ready
    assert found.command == f"exograv run train --drives drives.toml --participant CODE {FORM}"


@pytest.mark.parametrize(("source", "is_ready"), [("proposed", False), ("designed", True), ("own", True)])
def test_a_motion_that_is_only_proposed_is_designed_before_anything_else(source: str, is_ready: bool, bench: Bench):
    shutil.copytree(RIG.folder, "mine")
    text = Path("mine/rig.toml").read_text(encoding="utf-8")
    assert text.count("[excitation]") == 1
    Path("mine/rig.toml").write_text(
        text.replace("[excitation]", f'[excitation]\nsource = "{source}"'), encoding="utf-8"
    )
    command = "exograv rig motion mine --write"
    for simulate in (False, True):
        options = NextOptions(rig="mine", drives=Path("drives.toml"), simulate=simulate)
        found = next_step(options, Path("out"))
        assert (found.command != command) is (is_ready or simulate)
    refused = not_ready(replace(options, simulate=False), Path("out"), load_rig("mine"), "run live", lambda _: None)
    with pytest.raises(ExogravError) as caught:
        refused(bench.drives)
    assert (command in str(caught.value)) is not is_ready


def test_simulated_drives_need_no_bring_up_and_no_form(bench: Bench):
    found = bench.next(simulate=True)
    for name in ("bring-up", "acceptance"):
        assert said(found)[name] == "not needed: the drives are simulated."
    assert found.command == "exograv rig calibrate --drives drives.toml --simulate"


@pytest.mark.parametrize("command", sorted(NEEDED))
def test_each_command_over_drives_asks_for_the_same_checks_in_this_order(command: str, bench: Bench):
    options = NextOptions(drives=Path("drives.toml"))
    for prepare, lacking in ((nothing, "bring-up"), (brought_up, "calibration"), (untested, "self-test")):
        name, sentence, _ = prepare(bench)
        assert name == lacking
        shown = list[str]()
        refuse = not_ready(options, Path("out"), RIG, command, shown.append)
        if lacking not in NEEDED[command]:
            refuse(bench.drives)
            assert not shown
            continue
        with pytest.raises(ExogravError) as refused:
            refuse(bench.drives)
        assert str(refused.value) == sentence
        assert len(shown) == len(WORN)


ROOT = Path(__file__).parents[3]


def test_the_page_lists_every_command_over_drives_with_its_checks():
    text = (ROOT / "docs" / "howto" / "rig_test.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:3] for line in text.splitlines() if line.startswith("| `")]
    listed = {command.strip().strip("`"): checks.strip() for command, checks in rows}
    assert listed == {command: ", ".join(needs) or "none" for command, needs in NEEDED.items()}


def test_exactly_the_listed_commands_take_drives():
    takers = {path for path, action in cli.ACTIONS.items() if hasattr(command_class(action), "drives")}
    assert takers - {"next", "dev drive-sim"} == set(NEEDED)


def test_every_other_command_for_a_machine_says_why_it_does_not_take_drives():
    fields = {path: {one.field for one in options_of(command_class(action))} for path, action in cli.ACTIONS.items()}
    for_machines = {path for path, names in fields.items() if "rig" in names}
    assert for_machines - {"next", "dev drive-sim"} - set(NEEDED) == set(WITHOUT_DRIVES)


def test_the_reference_of_the_commands_lists_each_of_them_with_its_checks_or_its_reason(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.syspath_prepend(FOLDER)
    rows = docs_script("generate").commands_over_drives().splitlines()[2:]
    listed = {row.split("`")[1]: row.split("|")[2].strip() for row in rows}
    assert listed == {**dict.fromkeys(NEEDED, "yes"), **dict.fromkeys(WITHOUT_DRIVES, "no")}


@pytest.mark.parametrize("path", [*WITHOUT_DRIVES, "study status"])
def test_a_command_without_drives_refuses_them_with_its_reason_and_names_those_that_take_them(
    path: str, capsys: pytest.CaptureFixture[str]
):
    with pytest.raises(SystemExit):
        cli.parsed(path, ["--drives", "drives.toml"])
    reason = WITHOUT_DRIVES.get(path, "it has no option --drives")
    assert capsys.readouterr().err.splitlines()[0] == (
        f"exograv: `exograv {path}` does not fly over drives: {reason}. These commands do: "
        f"{', '.join(NEEDED)}. `exograv {path} --help` shows all options."
    )

"""A machine on its bus has adjusted lengths, a serial number of its own, and a calibration only after a bring-up."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from exograv import cli
from exograv.errors import ConfigError, ExogravError, RigError
from exograv.live.on_drives.connection import drives_with_hands
from exograv.live.on_drives.float_command import fly_on_drives
from exograv.live.on_drives.simulated_drives import simulated_drives
from exograv.live.options import LiveOptions, PersonForm
from exograv.model.description import load_rig
from exograv.options import MachineOptions
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.procedures.calibration.segment_lengths import settings_of_lengths
from exograv.rig.drives.settings import Drives, load_drives
from exograv.storage.bring_up_sheet import passed_sheet, write_sheet
from exograv.storage.machine_readiness import serial_of
from exograv.storage.self_test_step import Step

RIG = load_rig("recupera_like")
NOW = datetime(2026, 11, 22, 12, 0, tzinfo=UTC)
GOOD, BAD = Step("nudge", True, 1.0, 2.0), Step("nudge", False, 3.0, 2.0)


@pytest.fixture
def drives(tmp_path: Path) -> Drives:
    return load_drives(written(tmp_path, RIG), RIG)


def test_a_simulated_machine_never_has_the_serial_of_a_real_one(drives: Drives):
    real = serial_of(MachineOptions(), drives)
    simulated = serial_of(MachineOptions(simulate=True, level=2, seed=7), drives)
    other = serial_of(MachineOptions(simulate=True, level=2, seed=8), drives)
    assert real == drives.settings.serial
    assert len({real, simulated, other}) == 3


def test_what_is_not_named_is_set_to_its_nominal_length():
    nominal = {one.segment: one.nominal_m for one in RIG.settings.adjustments}
    segment, one = next(iter(nominal)), RIG.settings.adjustments[0]
    given = 0.5 * (one.nominal_m + one.max_m)
    assert settings_of_lengths(RIG, ()) == nominal
    assert settings_of_lengths(RIG, (f"{segment}={given}",)) == {**nominal, segment: given}


@pytest.mark.parametrize("text", ["upperarm=0.3", "upper_arm", "upper_arm=a", "upper_arm=30", "upper_arm=nan", "=0.3"])
def test_a_length_that_the_machine_cannot_be_set_to_is_refused_with_what_can(text: str):
    with pytest.raises(ConfigError, match="--length"):
        settings_of_lengths(RIG, (text,))


def test_only_a_bring_up_of_these_drives_that_has_passed_allows_a_calibration(tmp_path: Path, drives: Drives):
    path = tmp_path / "rig_test.toml"

    def refusal() -> str:
        with pytest.raises(ConfigError) as error:
            passed_sheet(path, RIG, drives, "exograv rig test --drives drives.toml --by INITIALS")
        return str(error.value)

    assert "missing" in refusal()
    assert "`exograv rig test --drives drives.toml --by INITIALS`" in refusal()
    write_sheet(path, RIG, drives, [GOOD, BAD], "ab", NOW, simulated=False)
    assert "failed" in refusal()
    write_sheet(path, RIG, drives, [GOOD], "", NOW, simulated=True)
    assert "simulated" in refusal()
    write_sheet(path, RIG, drives, [GOOD], "ab", NOW, simulated=False)
    passed_sheet(path, RIG, drives, "exograv rig test --drives drives.toml --by INITIALS")
    file = tmp_path / "drives.toml"
    file.write_text(file.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    drives = load_drives(file, RIG)
    assert "changed" in refusal()


def test_a_real_machine_needs_somebody_at_the_keyboard(drives: Drives, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    asked = MachineOptions(drives=tmp_path / "drives.toml")
    with (
        pytest.raises(ConfigError, match=r"A calibration needs an operator at the keyboard.*--simulate"),
        drives_with_hands(asked, RIG, lambda _: None, "A calibration"),
    ):
        pass


def test_live_on_drives_asks_for_a_motion_and_for_everything_about_the_person(tmp_path: Path):
    def refusal(identify_s: float, person: PersonForm) -> str:
        options = LiveOptions(
            identify_s=identify_s, drives=tmp_path / "drives.toml", calibration=tmp_path / "no.toml"
        )  # fmt: skip
        with pytest.raises(ConfigError) as error:
            fly_on_drives(options, person, tmp_path, lambda *_: None, lambda _: None)
        return str(error.value)

    assert "--identify" in refusal(0.0, PersonForm(1.7, 60.0, "female"))
    assert "--body-mass, --sex" in refusal(20.0, PersonForm(1.7))


@pytest.mark.parametrize(
    ("options", "command"),
    [
        (MachineOptions(simulate=True, seed=7), "exograv rig calibrate --seed 7 --simulate --out {folder}"),
        (
            MachineOptions(drives=Path("drives.toml")),
            "exograv rig test --drives drives.toml --out {folder} --by INITIALS",
        ),
        (
            MachineOptions(rig="recupera_like_7", drives=Path("drives.toml"), simulate=True),
            "exograv rig calibrate recupera_like_7 --drives drives.toml --simulate --out {folder}",
        ),
    ],
)
def test_a_run_on_drives_that_are_not_ready_names_the_whole_command_to_run_now(
    options: MachineOptions, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, load_rig(options.rig))
    live = LiveOptions(**vars(options), identify_s=60.0)
    person = PersonForm(height_m=1.75, mass_kg=70.0, sex="female")
    with pytest.raises(ExogravError) as refused:
        fly_on_drives(live, person, tmp_path, lambda _text, _share: None, print)
    said = str(refused.value)
    assert f"`{command.format(folder=tmp_path)}`" in said
    parsed = cli.parsed(*cli.resolved(said.split("`")[1].split()[1:]))
    assert (parsed.rig, parsed.simulate, parsed.drives) == (options.rig, options.simulate, options.drives)
    assert parsed.out == tmp_path


def test_an_error_after_simulated_drives_have_ended_gives_their_last_message(tmp_path: Path):
    told = ["--drives", str(written(tmp_path, RIG)), "--rig", "recupera_like", "--side", "right", "--lock-step"]
    with pytest.raises(RigError) as error:
        _act_after_the_end(told)
    assert "had ended (exit status 0). Their last message: " in str(error.value)


def _act_after_the_end(told: list[str]) -> None:
    with simulated_drives("udp", told) as tell:
        tell("quit")
        tell("help")

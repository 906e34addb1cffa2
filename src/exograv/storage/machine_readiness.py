"""Readiness of a machine on drives: what it must have passed before a command drives it, asked in this place only."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from exograv.errors import ConfigError, ExogravError
from exograv.model.description import RigDescription, load_rig
from exograv.next_command import calibration_command, calibration_words, same_machine
from exograv.options import CalibratedOptions, MachineOptions
from exograv.rig.drives.settings import Drives

from .bring_up_sheet import FILE as SHEET
from .bring_up_sheet import passed_sheet
from .calibration_file import GAIN_AGE_MAX, SIMULATED, TakenCalibration, in_world, take_calibration
from .self_test_pass import FILE as PASS
from .self_test_pass import MachineKey, valid_pass
from .twin_file import read_twin

Need = Literal["motion", "bring-up", "calibration", "self-test"]

EMPTY: tuple[Need, ...] = ("bring-up",)
TESTED: tuple[Need, ...] = ("bring-up", "calibration")
WORN: tuple[Need, ...] = ("motion", "bring-up", "calibration", "self-test")
"""Checks that a machine must have passed before it moves a person's arm, in the order in which they are made."""

NEEDED: Mapping[str, tuple[Need, ...]] = MappingProxyType(
    {
        "rig test": (),
        "rig calibrate": EMPTY,
        "rig self-test": TESTED,
        "rig accept": WORN,
        "arm identify": WORN,
        "arm weigh": WORN,
        "arm verify": WORN,
        "run live": WORN,
        "run console": WORN,
        "run train": WORN,
        "run support-level": WORN,
        "run assist": WORN,
        "run teach": WORN,
        "run repeat": WORN,
        "run mirror": WORN,
    }
)
"""Commands that fly over drives, each with the checks that its machine must have passed (docs/howto/rig_test.md)."""

_COMPUTES = "it computes from files and moves nothing"

WITHOUT_DRIVES: Mapping[str, str] = MappingProxyType(
    {
        "demo": "it shows the twin; `exograv run live --simulate` flies the same over drives",
        "rig check": _COMPUTES,
        "rig motion": _COMPUTES,
        "rig export": _COMPUTES,
        "data view": _COMPUTES,
        "data replay": _COMPUTES,
        "dev faults": "it makes the faults inside the twin",
        "dev transparency": "it measures effort by the twin's true torques",
    }
)
"""Commands for a machine that do not fly over drives, each with the reason."""


@dataclass(frozen=True)
class Check:
    """Row of a checklist."""

    name: str
    is_ready: bool
    found: str
    """State with its age, or the reason of a refusal with advice."""

    command: str = ""
    """Command to run now; empty if the check is passed."""

    @property
    def line(self) -> str:
        """Row as a line of text."""
        return f"{'ok' if self.is_ready else 'NO'}  {self.name}: {self.found}"


@dataclass(frozen=True)
class MachineReadiness:
    """Checks of one machine on drives, from its options and the files in the folder of `--out`."""

    options: CalibratedOptions
    folder: Path
    description: RigDescription
    drives: Drives
    now: datetime
    """Present time with its zone."""

    @property
    def serial(self) -> str:
        """Serial number of calibration and self-test."""
        return serial_of(self.options, self.drives)

    @property
    def calibration_file(self) -> Path:
        """File of the calibration: that of `--calibration`, or the one in the folder of `--out`."""
        return self.options.calibration_in(self.folder)

    @property
    def key(self) -> MachineKey:
        """Key that unlocks the machine.

        Raises:
            ConfigError: The calibration cannot be used.
        """
        seal = self.calibration().whole.content_sha256
        return MachineKey(self.folder / PASS, self.description, self.serial, seal, test=self._test)

    def calibration(self) -> TakenCalibration:
        """Read the calibration.

        Raises:
            ConfigError: The calibration is missing, damaged, of another machine or too old.
        """
        now = self.now.astimezone(UTC)
        return take_calibration(self.calibration_file, self.description, self.serial, now, self._calibrate)

    def refuse(self, needs: tuple[Need, ...], say: Callable[[str], object] = lambda _: None) -> None:
        """Refuse to drive the machine before it has passed these checks. `say` then shows the whole checklist.

        Raises:
            ExogravError: The first check that the machine has not passed, with the command to run now.
        """
        for need in needs:
            try:
                self._passed(need)
            except ExogravError:
                for check in self.checks():
                    say(check.line)
                raise

    def checks(self) -> list[Check]:
        """Return the checklist of a worn machine: each check with its state, its age and the command to run now."""
        checks = {need: self._check(need) for need in WORN}
        if not checks["calibration"].is_ready:
            # A self-test is one of a calibration, so nothing is known about it yet.
            checks["self-test"] = Check("self-test", False, "waits for the calibration.", self._calibrate)
        return list(checks.values())

    def _check(self, need: Need) -> Check:
        try:
            return Check(need, True, self._passed(need))
        except ExogravError as error:
            return Check(need, False, str(error), self._command(need))

    def _passed(self, need: Need) -> str:
        """Return the state of a check that is passed.

        Raises:
            ExogravError: It is not passed.
        """
        match need:
            case "motion":
                return self._designed()
            case "bring-up":
                return self._brought_up()
            case "calibration":
                return self._calibrated()
            case "self-test":
                passed = valid_pass(self.key, self.now).passing.at.astimezone(self.now.tzinfo)
                # The pass of a simulated machine says nothing about the timing, because nobody is in it.
                timing = "" if self.options.simulate else ", with the timing of this computer"
                return f"passed today at {passed:%H:%M}{timing}."

    def _designed(self) -> str:
        motion = self.description.settings.excitation
        if motion is None:
            return "none: the machine identifies no arm."
        if motion.source != "proposed":
            return {"own": "that of rig.toml.", "designed": "designed for this machine."}[motion.source]
        if self.options.simulate:
            return "proposed by `exograv rig new`, which is enough for simulated drives."
        raise ConfigError(
            "The motion that identifies an arm is the proposal of `exograv rig new`, not designed for this machine. "
            f"Design it first, in some minutes: `{self._command('motion')}`. Bring-up and calibration come afterwards."
        )

    def _brought_up(self) -> str:
        if self.options.simulate:
            return "not needed: the drives are simulated."
        bring_up = self._command("bring-up")
        sheet = passed_sheet(self.folder / SHEET, self.description, self.drives, bring_up)
        return f"passed on {sheet.done.at:%Y-%m-%d}, {age_text(self.now - sheet.done.at)} ago, by {sheet.done.by}."

    def _calibrated(self) -> str:
        taken = self.calibration()
        measured = taken.whole.measured
        ages = age_text(self.now - measured.at_utc), age_text(self.now - measured.friction_at_utc)
        warning = "" if taken.warning is None else f" {taken.warning}"
        return f"measured {ages[0]} ago, {GAIN_AGE_MAX.days} days are allowed; its friction {ages[1]} ago.{warning}"

    def _command(self, need: Need) -> str:
        match need:
            case "motion":
                return f"exograv rig motion {self.options.rig} --write"
            case "bring-up":
                return same_machine("rig test", self.options, self.folder, "--by INITIALS")
            case "calibration":
                return self._calibrate
            case "self-test":
                return self._test

    @property
    def _test(self) -> str:
        return same_machine("rig self-test", self.options, self.folder, calibration_words(self.options))

    @property
    def _calibrate(self) -> str:
        return calibration_command(self.options, self.folder)


def serial_of(options: MachineOptions, drives: Drives) -> str:
    """Return the serial number of calibration and self-test. Simulated drives never have the number of a real one.

    Raises:
        ConfigError: The options ask for a fitted twin, and the machine has none.
    """
    own = drives.settings.serial
    if not options.simulate:
        return own
    fitted = ""
    if options.twin == "fitted":
        fitted = f", twin {read_twin(load_rig(options.rig, options.side)).content_sha256[:12]}"
    return f"{own}{SIMULATED}{fitted}, level {options.level}, seed {options.seed}{in_world(options.world)}"


def age_text(age: timedelta) -> str:
    """Return an age in minutes, hours or days."""
    minutes = max(age.total_seconds(), 0.0) / 60.0
    for limit, unit, size in ((90.0, "min", 1.0), (36.0 * 60.0, "h", 60.0)):
        if minutes < limit:
            return f"{minutes / size:.0f} {unit}"
    days = round(minutes / 1440.0)
    return f"{days} days"

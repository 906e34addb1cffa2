"""Machine with motors, reached over its bus; or simulated drives in another process."""

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.live.live_figures import slow_ticks_text
from exograv.live.on_drives.float_command import fly_on_drives
from exograv.live.options import LiveOptions, PersonForm
from exograv.loop.pilot import Progress
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription
from exograv.options import CalibratedOptions
from exograv.procedures.calibration.options import CalibrateOptions
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.identification.verdict_text import carried_text
from exograv.procedures.self_test.options import SelfTestOptions
from exograv.storage.calibration_file import read_calibration

from .estimate import Estimate
from .flight import Flight, FlightPlan
from .rig_factory import run_calibration, run_self_test, simulated_wearer

Kind = TypeVar("Kind", bound=CalibratedOptions)


def quiet(_text: str, _share: float) -> None:
    """Ignore progress messages. Use as the callback of a silent run."""


class Drives:
    """Machine whose drives are described in drives.toml. Guard, control and recorder run in separate processes."""

    def __init__(
        self,
        rig: RigDescription,
        drives: str | Path | None = None,
        person: Body | None = None,
        *,
        folder: str | Path = "out",
        simulate: bool = False,
        level: int = 2,
        seed: int = 0,
        progress: Progress = quiet,
    ):
        """Describe the machine; nothing is connected yet.

        Args:
            rig: Machine, by `load_rig`.
            drives: drives.toml of the machine (docs/howto/rig_test.md); may be absent with `simulate`.
            person: Body data of the person in the machine; with `simulate`, the simulated wearer's own.
            folder: Folder of the machine's calibration and of the self-test of the day.
            simulate: True for simulated drives in another process, with a simulated wearer.
            level: Level of the disturbances of simulated drives.
            seed: Seed of simulated drives.
            progress: Called from time to time with a text and the share done.

        Raises:
            ConfigError: Neither `drives` nor `simulate` is given.
        """
        if drives is None and not simulate:
            raise ConfigError("drives is None: give the drives.toml of the machine, or simulate=True to practise.")
        if person is None and not simulate:
            raise ConfigError("person is None: give the body data of the person in the machine.")
        self.rig, self.folder, self._progress = rig, Path(folder), progress
        self._drives, self._simulate = None if drives is None else Path(drives), simulate
        self._person, self._level, self._seed = person, level, seed

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every array."""
        return self.rig.joints

    @property
    def person(self) -> Body:
        """Body data of the person in the machine."""
        if self._person is not None:
            return self._person
        if self._wearer is None:
            raise ConfigError("person is None: give the body data of the person in the machine.")
        return self._wearer.form.body

    def prepare(self) -> Calibration:
        """Calibrate the empty machine if no calibration exists, and test it if it was not tested today.

        On a real machine both steps ask the operator for input; the bring-up (`exograv rig test`) must have passed.

        Raises:
            ConfigError: A file cannot be used.
            IdentificationError: The machine is not as its description says.
            RigError: A drive does not answer, the guard stopped the run, or the self-test failed.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        options = self._options(CalibrateOptions)
        file = options.calibration_in(self.folder)
        if not file.is_file():
            run_calibration(options, self.folder, self._progress, print)
        result = run_self_test(self._options(SelfTestOptions), self.folder, self._progress, print)
        if not result.ok:
            failed = "; ".join(f"{step.name}: {step.what_to_do}" for step in result.steps if step.passed is False)
            raise RigError(f"The self-test failed. {failed}")
        return read_calibration(file).calibration()

    def float_as_planned(self, plan: FlightPlan) -> Flight:
        """Carry out a plan of `float_arm`."""
        if plan.estimate is not None:
            raise ConfigError("estimate is given; on drives the arm is identified in each flight. Leave it out.")
        if plan.law is not None:
            raise ConfigError("law is given; on drives control runs in a process of its own. Try the law on the twin.")
        options = replace(
            self._options(LiveOptions), seconds=plan.seconds, identify_s=plan.identify_s,
            gravity_level=plan.gravity_level,
        )  # fmt: skip
        wearer = self._wearer
        told = PersonForm() if wearer is not None else self._form()
        run = fly_on_drives(options, told, self.folder, self._progress, print, wearer)
        stops = tuple(latch.cause for latch in run.flown.report.latches)
        learned = run.flown.learned
        if learned is None:
            cause = "; ".join(stop.rstrip(".") for stop in stops) or "the run ended before that"
            slow = slow_ticks_text(run.flown.report.timing) or "On a busy computer, first end other programs."
            raise RigError(
                f"The arm was not identified: {cause}. The recording is kept: {run.flown.path}. Test the machine again "
                f"with `prepare`, then repeat. {slow}"
            )
        found = learned.estimate
        figures = run.figures.identified
        truth = None if figures is None or figures.left_over_Nm is None else np.array(figures.left_over_Nm)
        known = run.prepared
        estimate = Estimate(
            self.person, known.assembly, known.machine, found.x, found.covariance, learned.outcome.value,
            motion_s=found.t, why=learned.why,
        )  # fmt: skip
        plan.path.parent.mkdir(parents=True, exist_ok=True)
        run.flown.path.replace(plan.path)
        why = carried_text(learned.carried, self.rig.joints, found.t)
        return Flight(estimate, plan.path, stops, why=why, left_over_true=truth)

    def _options(self, kind: type[Kind]) -> Kind:
        return kind(
            rig=str(self.rig.folder),
            side=self.rig.side,
            level=self._level,
            seed=self._seed,
            drives=self._drives,
            simulate=self._simulate,
        )

    @cached_property
    def _wearer(self) -> SimulatedWearer | None:
        return simulated_wearer(self._options(LiveOptions))

    def _form(self) -> PersonForm:
        """Body data as the options of a live run state them."""
        person = self.person
        lengths = tuple(f"{segment}={length}" for segment, length in (person.lengths_m or {}).items())
        return PersonForm(person.height_m, person.mass_kg, person.sex, lengths)

"""Simulated machine with a simulated wearer."""

from dataclasses import replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.laboratory.preparation import Preparation, WornTwin, no_progress
from exograv.laboratory.provenance import run_settings
from exograv.laboratory.virtual_laboratory import laboratory_at
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.pilot import Progress
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription
from exograv.options import WorldName
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.float_arm import float_arm
from exograv.procedures.identification.verdict_text import carried_text
from exograv.recording import RecordingWriter
from exograv.results import json_value
from exograv.rig.twin import Disturbances
from exograv.rig.twin import Twin as TwinRig
from exograv.safety.guard import COMMAND_LIFE_S
from exograv.signals import Command, JointState
from exograv.storage.calibration_file import identity_of, twin_identity, write_calibration
from exograv.storage.calibration_schema import MeasurementConditions, stored

from .estimate import Estimate
from .flight import Flight, FlightPlan
from .law import CompensationWithLaw, Law

Joints = Float[np.ndarray, " joint"]

LEVELS = range(5)

BEFORE_LAW_S = 1.0
"""Flight before the law is switched on [s]."""


class Twin:
    """Machine and wearer in MuJoCo, drawn from a seed: friction, soft cuffs, misaligned joints, noise, muscles.

    Neither the controller nor the estimator has access to the parameters of the twin.
    """

    def __init__(
        self,
        rig: RigDescription,
        *,
        level: int = 2,
        world: WorldName = "home",
        seed: int = 0,
        progress: Progress = no_progress,
    ):
        """Draw machine and wearer.

        Args:
            rig: Machine, by `load_rig`.
            level: Level of all disturbances: 0 none, 1 mild, 2 a good laboratory, 3 an ordinary day, 4 a bad one.
            world: Laws of machine and wearer: `home`, or foreign ones of `tissue`, `shoulder`, `cuffs`, `drives` or
                `all`; `unseen` for other published laws, `bodies` for another anthropometric sample.
            seed: Seed of machine, wearer and run; the same seed gives the same figures.
            progress: Called from time to time with a text and the share done.

        Raises:
            ConfigError: The level is not 0 to 4, the world does not exist, the seed is negative, or the machine has
                joints without a motor.
        """
        if level not in LEVELS or seed < 0:
            raise ConfigError(f"level is {level} and seed is {seed}; allowed: level 0 to 4, seed 0 and above.")
        refuse_motorless(rig)
        drawn = laboratory_at(rig, Disturbances.at_level(level, world), seed, seed)
        self.rig, self.level, self.seed = rig, level, seed
        self._laboratory = replace(drawn, serial=twin_identity(level, seed, world))
        self._preparation = Preparation(self._laboratory, seed, progress)
        self._calibrated: tuple[Calibration, float] | None = None

    @property
    def person(self) -> Body:
        """Body data of the wearer, as an operator measures them with scale and tape."""
        return self._laboratory.body

    @property
    def serial(self) -> str:
        """Identity of the machine, for files that belong to it."""
        return self._laboratory.serial

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every array."""
        return self.rig.joints

    def prepare(self) -> Calibration:
        """Calibrate the empty machine: torque constants, friction, weight of its links. Later calls return the same.

        Raises:
            ExogravError: The machine or the run was refused.
        """
        if self._calibrated is None:
            self._calibrated = self._preparation.calibrate()
        return self._calibrated[0]

    def save_calibration(self, path: str | Path) -> Path:
        """Write the calibration of `prepare` to a file that `load_calibration` and `--calibration` read.

        Raises:
            ConfigError: The file cannot be written.
        """
        calibration, now = self.prepare(), datetime.now(UTC).replace(microsecond=0)
        lengths = dict(self._laboratory.wearer.lengths_given)
        conditions = MeasurementConditions(
            at_utc=now, friction_at_utc=now, running_s=round(self._rig_time_s, 3), lengths_m=lengths
        )
        write_calibration(Path(path), stored(calibration, identity_of(self.rig, self.serial), conditions, self.joints))
        return Path(path)

    @property
    def _rig_time_s(self) -> float:
        """Time on the machine's clock after calibration [s]."""
        return 0.0 if self._calibrated is None else self._calibrated[1]

    @cached_property
    def _stepped(self) -> TwinRig:
        """Machine and wearer that `read` and `step` use."""
        return self._laboratory.twin(self.seed, self._rig_time_s)

    @property
    def actuators(self) -> ActuatorGain:
        """Torque constants of the motors: calibrated after `prepare`, by the data sheets before [N·m/A]."""
        if self._calibrated is not None:
            return self._calibrated[0].machine.actuators
        return ActuatorGain(self.rig.nominal_gain, np.zeros(len(self.joints)))

    @property
    def period_s(self) -> float:
        """Period of `step` [s]."""
        return self._stepped.period_s

    @property
    def t(self) -> float:
        """Time on the machine's clock [s]."""
        return self._stepped.t

    def read(self) -> JointState:
        """Measure: positions `q` [rad] and motor currents [A]. `actuators.torque(current)` is the measured torque."""
        return self._stepped.read()

    def step(self, tau: Joints) -> JointState:
        """Command motor torques (joint,) [N·m], advance by one period, and measure. There is no guard in between.

        Raises:
            ConfigError: `tau` has another shape, or a value is not finite.
            RigError: The simulation diverged.
        """
        tau = np.asarray(tau, dtype=float)
        if tau.shape != (len(self.joints),) or not np.isfinite(tau).all():
            raise ConfigError(f"tau is {tau.tolist()}; it must hold {len(self.joints)} finite torques [N·m].")
        rig = self._stepped
        rig.write(Command(rig.t, rig.read().sequence, rig.t + COMMAND_LIFE_S, tau, tau / self.actuators.gain))
        return rig.read()

    def reset(self) -> None:
        """Start again with the wearer at rest in the donning posture."""
        self.__dict__.pop("_stepped", None)

    def left_over_true(self, estimate: Estimate) -> Joints:
        """Compute the true left over of an estimate at held-out postures, RMS per joint [N·m]."""
        known = ControllerKnowledge(estimate.assembly, estimate.machine, estimate.x, 0.0)
        return self._preparation.worn(known).examination().score(estimate.x).total

    def float_as_planned(self, plan: FlightPlan) -> Flight:
        """Carry out a plan of `float_arm`."""
        calibration = self.prepare()
        asked = {"identify_s": plan.identify_s, "gravity_level": plan.gravity_level, "seconds": plan.seconds}
        settings = run_settings(
            self._laboratory, "exograv.float_arm", self.level, self.seed, {"options": json_value(asked)}
        )
        plan.path.parent.mkdir(parents=True, exist_ok=True)
        with RecordingWriter(plan.path, self.joints, json_value(settings)) as recording:
            preparation = replace(self._preparation, recording=recording)
            known = preparation.known(
                calibration, self._rig_time_s, None if plan.estimate is None else plan.estimate.assembly
            )
            estimate, carried = plan.estimate, None
            if estimate is not None:
                carried = estimate.carried()
                known = replace(known, x=carried.x)
            worn = preparation.worn(known)
            if estimate is None or carried is None:
                identifier = worn.identifier()
                found = worn.identify(identifier, plan.identify_s)
                last, carried = found.last, found.decided
                estimate = Estimate(
                    self.person, known.assembly, known.machine, last.x, last.covariance, found.outcome.value,
                    found.method.name, last.t, found.why,
                )  # fmt: skip
            else:
                worn.limit_to_person()
            lower, upper = self.rig.workspace
            alone_s = plan.seconds if plan.law is None else BEFORE_LAW_S
            middle = 0.5 * (lower + upper)
            drift = float_arm(
                worn.pilot, worn.controller, middle, plan.gravity_level, alone_s, covariance=carried.covariance
            )
            if plan.law is not None:
                self._fly_law(worn, plan.law, plan.seconds)
        truth = worn.examination().score(carried.x).total
        why = carried_text(carried, self.joints, estimate.motion_s)
        return Flight(estimate, plan.path, why=why, drift_deg=drift.drift_deg, left_over_true=truth)

    @staticmethod
    def _fly_law(worn: WornTwin, law: Law, seconds: float) -> None:
        pilot = worn.pilot
        pilot.begin("law")
        controller = CompensationWithLaw(worn.controller, law, pilot.rig.period_s)
        pilot.run(controller, motion.hold(pilot.q.copy(), seconds, pilot.rig.period_s), "Floating with a law")

"""Wearer of exograv's twin in a hidden machine: the cuffs, and nothing else, join the two engines."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import RigError
from exograv.identification.calibration.empty_machine import GAIN_SD, Calibration
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.tree import inertial_parameters
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.procedures.calibration.calibrate import calibrate_machine
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.rig.twin import Machine, Twin
from exograv.rig.twin.twin import SUBSTEPS, Truth
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.safety.envelope import Envelope
from exograv.signals import Command, JointState

from .draw import PERIOD_S, Hidden
from .engine import CURRENT, JOINTS, Engine, Joints, Q, V
from .geometry import Geometry, lengthened
from .rig import HiddenRig, HiddenSensors


def at_lengths(geometry: Geometry, description: RigDescription, lengths: Mapping[str, float]) -> Geometry:
    """Return the machine set to lengths by segment [m], within the range of its adjustments."""
    for one in description.settings.adjustments:
        length = float(np.clip(lengths.get(one.segment, one.nominal_m), one.min_m, one.max_m))
        geometry = lengthened(geometry, one.joint, one.axis, length)
    return geometry


def as_machine(hidden: Hidden, geometry: Geometry, usual: Machine) -> Machine:
    """Return links, rotors, gains and gravity of a hidden machine in the twin's form; the rest stays as `usual`.

    The twin takes from it the posture at which the arm rests, and what an experienced wearer knows of the machine.
    Examiners take the noise of the currents.
    """
    values = hidden.values
    links = zip(values["mass"].tolist(), values["com"], values["inertia"], strict=True)
    phi = [inertial_parameters(mass, com, inertia) for mass, com, inertia in links]
    drives = replace(
        usual.drives, gain=values["gain"], rotor_inertia=values["rotor"], gear_stiffness=np.full(JOINTS, np.inf)
    )
    return replace(
        usual,
        drives=drives,
        sensors=replace(usual.sensors, current_noise=values["gain"] * hidden.sensing.current_noise),
        gravity=values["gravity"],
        links=dict(zip(geometry.joints, phi, strict=True)),
        foreign=None,
    )


class HiddenTwin(Twin):
    """Twin whose machine is a hidden one. MuJoCo moves the arm only.

    In each half period the joints of MuJoCo's machine are set to those of the hidden one, and the torque of the cuffs
    on these joints acts on the hidden machine. Arm and machine share no inertia, so nothing else passes between them.
    """

    def __init__(
        self,
        laboratory: "HiddenLaboratory",
        seed: int,
        t0: float,
        start_posture: Joints | None,
        surroundings: Surroundings | None,
    ):
        """Start at rest; arguments as in `VirtualLaboratory.twin`."""
        hidden, wearer = laboratory.hidden, laboratory.wearer
        super().__init__(
            laboratory.description, laboratory.machine, wearer, seed, start_posture, t0, surroundings=surroundings
        )
        period = {"period": np.array(PERIOD_S / SUBSTEPS), "substeps": hidden.values["substeps"] / SUBSTEPS}
        data, exo = self._scene.data, self._scene.exo
        q = data.qpos[exo]
        self.engine = Engine({**hidden.values, **period}, q)
        """Equations of the machine, for examiners."""
        self.engine.hold(q, super().truth.tau_motor)
        self._ran_s = laboratory.ran_s
        self.engine.t = t0 + self._ran_s
        self._hidden_sensors, self._gain = HiddenSensors(hidden, self.engine), hidden.values["gain"]

    @property
    def truth(self) -> Truth:
        """State behind the measurements, as copies."""
        return replace(super().truth, tau_motor=self._gain * self.engine.x[CURRENT])

    def read(self) -> JointState:
        """Return the measurement of this period; two calls in one period return the same one."""
        if self._measured is None:
            self._measured = self._hidden_sensors.measure(self.t, self._steps // SUBSTEPS)
        return self._measured

    def write(self, command: Command) -> None:
        """Give the drives a current and advance by one period.

        Raises:
            RigError: The current is not finite, or an engine diverged.
        """
        if not np.isfinite(command.current).all():
            raise RigError(f"Command {command.sequence} is not finite.")
        damping = np.zeros(JOINTS) if command.damping is None else command.damping
        self._damping[:] = damping  # for `drive_damping`; MuJoCo's own drives do not act
        for muscles, tau in self._muscle_torques:
            tau[:] = muscles.next_torque()
        model, data, exo, engine = self._scene.model, self._scene.data, self._scene.exo, self.engine
        for _ in range(SUBSTEPS):
            for pole in self._poles:
                pole.before_forces()
            mujoco.mj_step1(model, data)
            self._forces.evaluate()
            for pole in self._poles:
                pole.after_forces()
            mujoco.mj_step2(model, data)
            engine.outside[:] = self._cuff_torque() + self.tau_hand
            engine.advance(command.current, damping, command.valid_until + self._ran_s)
            data.qpos[exo], data.qvel[exo] = engine.x[Q], engine.x[V]
        self.end_native(not (np.isfinite(engine.x).all() and np.isfinite(data.qvel).all()))

    def turn_motor(self, joint: int, factor: float) -> None:
        """Multiply the torque of a motor by `factor`, the torque in its delay lines included; for examiners only."""
        self.engine.scale_current(joint, factor)

    def _cuff_torque(self) -> Joints:
        """Torque of the cuffs on the machine's joints in the last step [N·m]: MuJoCo's sum without all other forces."""
        data, exo = self._scene.data, self._scene.exo
        return (data.qfrc_smooth + data.qfrc_bias - data.qfrc_passive - data.qfrc_applied - data.qfrc_actuator)[exo]


@dataclass(frozen=True)
class HiddenLaboratory(VirtualLaboratory):
    """Wearer of the twin and a hidden machine, which is `machine` in the twin's form."""

    hidden: Hidden = field(kw_only=True)
    geometry: Geometry = field(kw_only=True)
    """Geometry of the machine, set to the wearer's lengths."""
    ran_s: float = field(kw_only=True)
    """Time for which the machine has run before [s]: its friction is as warm."""

    @classmethod
    def of(cls, drawn: VirtualLaboratory, hidden: Hidden, geometry: Geometry, ran_s: float) -> "HiddenLaboratory":
        """Put the wearer of a laboratory into a hidden machine."""
        here = at_lengths(geometry, drawn.description, drawn.wearer.lengths_given)
        moved = Hidden(hidden.seed, {**hidden.values, "origin": here.origin}, hidden.sensing)
        machine = as_machine(moved, here, drawn.machine)
        return cls(drawn.description, machine, drawn.wearer, hidden=moved, geometry=here, ran_s=ran_s)

    def twin(
        self,
        seed: int,
        t0: float = 0.0,
        start_posture: Joints | None = None,
        surroundings: Surroundings | None = None,
    ) -> Twin:
        """Put the wearer into the machine; arguments as in `VirtualLaboratory.twin`."""
        return HiddenTwin(self, seed, t0, start_posture, surroundings)


class HiddenPreparation(Preparation):
    """Steps of one run in a `HiddenLaboratory`."""

    def calibrate(self) -> tuple[Calibration, float]:
        """Calibrate the empty hidden machine; return the result and the rig's clock at the end [s].

        Raises:
            ExogravError: The machine or the run was refused.
        """
        laboratory = self.laboratory
        if not isinstance(laboratory, HiddenLaboratory):
            raise RigError("This laboratory has no hidden machine.")
        description = laboratory.description
        tree = adjusted(read_exoskeleton(description), description, laboratory.wearer.lengths_given)
        rig = HiddenRig(laboratory.geometry, laboratory.hidden, starting_posture(tree), laboratory.ran_s)
        nominal = description.nominal_gain
        gain, envelope = ActuatorGain(nominal, GAIN_SD * nominal), Envelope(limits(description), rig.period_s)
        pilot = Pilot(rig, gain, envelope, self.recording, self.progress)
        pilot.begin("calibrate")
        return calibrate_machine(description, tree, pilot, ComputedOperator(rig.hang)), rig.t

"""Torque that carries machine and arm at any posture and gravity level, with its interval."""

from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.control.tick import Tick
from exograv.errors import ConfigError, ModelError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription
from exograv.procedures.identification.estimator_session import table_guess
from exograv.safety.guard import GRAVITY_LEVEL_MAX

from .arm_in_machine import arm_in_machine
from .estimate import Estimate

Joints = Float[np.ndarray, " joint"]

GRAVITY_LEVELS = (0.0, GRAVITY_LEVEL_MAX)
"""Range of gravity levels: weightless to the pull-up of a parabolic flight [Earth gravity]."""

DRAWS = 1000
"""Arms that `Compensator.interval` draws from the covariance; the ends of an interval vary by 3 % of its width."""


class Compensator:
    """Gravity compensation of one arm in one machine. For planning and analysis; a flight uses the compiled tick."""

    def __init__(self, rig: RigDescription, arm: Body | Estimate, calibration: Calibration | None = None):
        """Build the model and compile it, which takes about a second.

        Args:
            rig: Machine, by `load_rig`.
            arm: Person, whose arm then has the values of the anthropometric table, or an estimate of the arm.
            calibration: Calibration of the machine, if `arm` is a person; its data sheets if None.

        Raises:
            ConfigError: The estimate belongs to another machine.
            ModelError: The machine does not fit the person.
        """
        if isinstance(arm, Estimate):
            if arm.rig.sha256 != rig.sha256:
                raise ConfigError(f"The estimate belongs to '{arm.rig.name}', not to '{rig.name}'. Identify again.")
            self.assembly, machine, self.x, self.covariance = arm.assembly, arm.machine, arm.x, arm.covariance
            self._mean = self.x
        else:
            self.assembly, machine = arm_in_machine(rig, arm, calibration)
            self.x = table_guess(self.assembly, machine)
            self._mean, self.covariance = prior(self.assembly, machine)
        self._tick = Tick(self.assembly, machine)
        self._z = np.zeros(self.assembly.n_freedoms)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every array."""
        return self.assembly.description.joints

    def torque(self, q: Joints, gravity_level: float = 0.0) -> Joints:
        """Compute the torque that holds machine and arm at rest at `q` (joint,) [rad]; positive along the axis [N·m].

        Args:
            q: Joint positions.
            gravity_level: Share of its own weight that the arm feels: 0 weightless, 1 Earth, 1.8 at most. The weight of
                the machine is always carried.

        Raises:
            ConfigError: `q` or `gravity_level` is not allowed.
            ModelError: The loops of machine and arm do not close at `q`.
        """
        return self._at(self._checked(q, gravity_level), self.x)

    def interval(self, q: Joints, gravity_level: float = 0.0) -> Float[np.ndarray, "2 joint"]:
        """Compute the 95 % interval of `torque`: lower and upper bound [N·m].

        Arms are drawn from the covariance of the parameters, with a fixed seed, because the strain of the
        cuffs is not linear in the position of the shoulder.

        Raises:
            ConfigError: `q` or `gravity_level` is not allowed, or the estimate states no uncertainty.
            ModelError: The loops of machine and arm do not close at `q`.
        """
        q = self._checked(q, gravity_level)
        self._at(q, self.x)
        torques = np.array([self._at(q, x) for x in self._drawn])
        return np.percentile(torques, [2.5, 97.5], axis=0)

    @cached_property
    def _drawn(self) -> Float[np.ndarray, "draw parameter"]:
        if self.covariance is None:
            raise ConfigError("The estimate states no uncertainty; identify with method 'recursive'.")
        variance, axes = np.linalg.eigh(self.covariance)
        normal = np.random.default_rng(0).standard_normal((DRAWS, len(variance)))
        return self._mean + (normal * np.sqrt(np.maximum(variance, 0.0))) @ axes.T

    def _checked(self, q: Joints, gravity_level: float) -> Joints:
        array = np.asarray(q, dtype=float)
        if array.shape != (self.assembly.n,) or not np.isfinite(array).all():
            raise ConfigError(
                f"q is {np.asarray(q).tolist()}; it must hold {self.assembly.n} finite positions [rad], of "
                f"{', '.join(self.joints)}."
            )
        least, most = GRAVITY_LEVELS
        if not least <= gravity_level <= most:
            raise ConfigError(f"gravity_level is {gravity_level}; allowed: {least:g} (weightless) to {most:g}.")
        self._tick.mode.gravity_level = gravity_level
        return array

    def _at(self, q: Joints, x: Float[np.ndarray, " parameter"]) -> Joints:
        tau, _, z = self._tick.at_rest(q, x, self._z)
        if not self._tick.is_closed:
            degrees = ", ".join(f"{angle:.0f}°" for angle in np.rad2deg(q))
            raise ModelError(f"The loops of machine and arm do not close at {degrees}. Choose a posture in reach.")
        self._z = z
        return tau

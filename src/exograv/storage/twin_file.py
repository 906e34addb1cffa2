"""File `twin.toml` of a machine's folder: the machine's twin from recordings, with covariance and provenance."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float
from pydantic import AwareDatetime, Field, NonNegativeFloat, PositiveFloat

from exograv.errors import ConfigError
from exograv.identification.calibration.empty_prior import EmptyLayout
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Settings

from .calibration_file import identity_of, refuse_other_machine
from .calibration_schema import Identity
from .sealed_file import Sealed, read_sealed, write_sealed

NAME = "twin.toml"
"""Name of the file in the folder of a machine."""

HEAD = """\
# Twin of a machine, written by `exograv twin fit` (docs/howto/twin.md). Each value has its standard deviation beside it
# (_sd); [posterior] has the covariance of all of them. Do not edit: a changed file is refused.
"""

MAKE = "Fit it: `exograv twin fit RIG RECORDINGS`, and give the folder that it writes as the machine."

Numbers = list[float]


class FittedRecording(Settings):
    """Recording to which the twin was fitted."""

    file: str
    sha256: str
    seconds: NonNegativeFloat
    """Length of the used part [s]."""


class Provenance(Settings):
    """Origin of the values."""

    at_utc: AwareDatetime
    exograv: str
    """Version of exograv."""
    held_out_s: NonNegativeFloat
    """Length of the part of the recordings that validated the fit [s]."""
    lengths_m: dict[str, PositiveFloat]
    """Lengths to which the machine was set, by segment."""
    recordings: Annotated[list[FittedRecording], Field(min_length=1)]


class FittedDrive(Settings):
    """Response of one joint's drive to its commands."""

    joint: str
    bandwidth_Hz: PositiveFloat
    bandwidth_sd_log: NonNegativeFloat
    """Standard deviation of the natural logarithm of the bandwidth."""
    damping: NonNegativeFloat
    """Damping ratio of a lag of second order; 0 for a first order."""
    first_order_Hz: PositiveFloat
    """Bandwidth of the nearest lag of first order, which the simulated drive has."""


class FittedGear(Settings):
    """Elasticity of one joint's gear."""

    joint: str
    compliance_rad_per_Nm: float
    """Angle between motor and joint per torque in the gear."""
    compliance_sd_rad_per_Nm: NonNegativeFloat


class FittedWarmGain(Settings):
    """Change of one joint's gain with the temperature of its motor's winding."""

    joint: str
    slope_per_C: float
    """Change of the gain over the gain, per degree."""
    slope_sd_per_C: NonNegativeFloat
    at_C: float
    """Temperature at which the gain is `gain_Nm_per_A`: the mean of the recordings."""
    lowest_C: float
    highest_C: float


class FittedCuffs(Settings):
    """Stiffness of the cuffs over that in `rig.toml`, by recordings of an arm in the machine; natural logarithms."""

    log_stiffness: float
    """Translation."""
    log_stiffness_sd: NonNegativeFloat
    log_rotational_stiffness: float
    """Rotation."""
    log_rotational_stiffness_sd: NonNegativeFloat
    correlation: Annotated[float, Field(ge=-1.0, le=1.0)]
    recordings: Annotated[list[FittedRecording], Field(min_length=1)]
    """Recordings with an arm in the machine; their lengths are those of the identifications."""

    def draw(self, seed: int) -> Float[np.ndarray, " 2"]:
        """Draw the factors on the stiffness, in translation and in rotation [-]."""
        first, second = np.random.default_rng([seed, CUFF_STREAM]).standard_normal(2)
        second = self.correlation * first + np.sqrt(1.0 - self.correlation**2) * second
        sd = np.array([self.log_stiffness_sd, self.log_rotational_stiffness_sd])
        return np.exp(self.mean() + sd * [first, second])

    def mean(self) -> Float[np.ndarray, " 2"]:
        """Return both logarithms [-]."""
        return np.array([self.log_stiffness, self.log_rotational_stiffness])


class FittedJoint(Settings):
    """Joint with its drive and its sensors."""

    joint: str
    law: str
    """Law of friction that the recordings chose."""
    gain_Nm_per_A: float
    gain_sd_Nm_per_A: NonNegativeFloat
    coulomb_Nm: float
    coulomb_sd_Nm: NonNegativeFloat
    viscous_Nms_per_rad: float
    """Factor of speed, or of its power, in viscous friction."""
    viscous_sd_Nms_per_rad: NonNegativeFloat
    viscous_power: float
    viscous_power_sd: NonNegativeFloat
    breakaway: float
    breakaway_sd: NonNegativeFloat
    v_stribeck_rad_per_s: PositiveFloat
    load_share: float
    load_share_sd: NonNegativeFloat
    asymmetry_Nm: float
    asymmetry_sd_Nm: NonNegativeFloat
    rotor_inertia_kgm2: float
    rotor_inertia_sd_kgm2: NonNegativeFloat
    encoder_offset_deg: float
    encoder_offset_sd_deg: NonNegativeFloat
    encoder_step_rad: NonNegativeFloat
    noise_Nm: NonNegativeFloat
    """Standard deviation of the noise of the measured torque per tick."""
    held_out_rms_Nm: NonNegativeFloat
    """Residual torque on the held-out part per tick, noise included."""
    held_out_slow_rms_Nm: NonNegativeFloat
    """Residual torque on the held-out part below 7 Hz."""
    moved_s: NonNegativeFloat
    fastest_rad_per_s: NonNegativeFloat


class Posterior(Settings):
    """Mean and covariance of all unknowns, in the order of `identification.calibration.empty_prior.EmptyLayout`."""

    per_joint: list[str]
    weights: Annotated[int, Field(ge=0)]
    mean: Numbers
    covariance: list[Numbers]
    """Rows of the covariance up to its diagonal."""

    def matrix(self) -> Float[np.ndarray, "unknown unknown"]:
        """Return the covariance as a full matrix."""
        n = len(self.mean)
        lower = np.zeros((n, n))
        for k, row in enumerate(self.covariance):
            lower[k, : k + 1] = row
        return lower + lower.T - np.diag(np.diag(lower))


class StoredTwin(Sealed):
    """Twin of a machine as its file `twin.toml` holds it."""

    VERSION: ClassVar[int] = 3
    OLDER: ClassVar[tuple[int, ...]] = (1, 2)
    schema_version: Literal[1, 2, 3]
    identity: Identity
    provenance: Provenance
    delay_ms: list[float]
    """Delay of command and measurement together, and its standard deviation; empty if no recording has commands."""
    first_order_delay_ms: list[float]
    """Delay beside the nearest lags of first order, which the simulated machine has; empty as `delay_ms`."""
    drives: list[FittedDrive]
    """Drives whose response the recordings tell."""
    gears: list[FittedGear]
    """Gears whose elasticity the recordings tell."""
    has_motor_encoders: bool = True
    """True if the recordings hold positions of all motors that are no copies of the joints' positions. Files of
    version 1 do not say it."""
    gain_by_temperature: list[FittedWarmGain] = Field(default_factory=list[FittedWarmGain])
    """Gains whose change with temperature the recordings tell; files of version 1 have none."""
    cuffs: Annotated[list[FittedCuffs], Field(max_length=1)] = Field(default_factory=list[FittedCuffs])
    """Cuffs, if a recording with an arm in the machine tells them; files of versions 1 and 2 have none."""
    joints: Annotated[list[FittedJoint], Field(min_length=1)]
    posterior: Posterior

    def _sealed_values(self) -> dict[str, Any]:
        content = super()._sealed_values()
        if self.schema_version < 3:
            del content["cuffs"]
        if self.schema_version == 1:
            del content["has_motor_encoders"], content["gain_by_temperature"]
        return content

    def layout(self) -> EmptyLayout:
        """Order of the unknowns of the posterior."""
        return EmptyLayout(len(self.joints), self.posterior.weights, tuple(self.posterior.per_joint))

    def draw(self, seed: int) -> Float[np.ndarray, " unknown"]:
        """Draw the unknowns from the posterior."""
        covariance, mean = self.posterior.matrix(), np.array(self.posterior.mean)
        sd = np.sqrt(np.diag(covariance))
        # Units differ by a factor of a million: the correlation matrix has a sound decomposition.
        values, vectors = np.linalg.eigh(covariance / np.outer(sd, sd))
        drawn = np.random.default_rng([seed, DRAW_STREAM]).standard_normal(len(mean))
        return mean + sd * (vectors @ (np.sqrt(np.maximum(values, 0.0)) * drawn))


DRAW_STREAM, CUFF_STREAM = 34, 35
"""Numbers that separate the draws of the posterior and of the cuffs from other draws of the same seed."""


def write_twin(path: Path, whole: StoredTwin) -> None:
    """Write the file, or leave the old one as it was.

    Raises:
        ConfigError: The file cannot be written.
    """
    write_sealed(path, whole, HEAD, "--out")


def read_twin(description: RigDescription) -> StoredTwin:
    """Read the twin of a machine from its folder.

    Raises:
        ConfigError: The folder has no twin, or it is damaged or of another machine.
    """
    path = description.folder / NAME
    if not path.is_file():
        raise ConfigError(f"{description.folder} has no {NAME}: this machine has no fitted twin. {MAKE}")
    whole = read_sealed(path, StoredTwin, MAKE, MAKE)
    refuse_other_machine(path, whole.identity, identity_of(description, whole.identity.machine), MAKE)
    joints = tuple(row.joint for row in whole.joints)
    if joints != description.joints:
        raise ConfigError(f"{path} has the joints {', '.join(joints)}; they must be {', '.join(description.joints)}.")
    unknowns = len(whole.posterior.mean)
    if unknowns != whole.layout().links.stop or [len(row) for row in whole.posterior.covariance] != [
        *range(1, unknowns + 1)
    ]:
        raise ConfigError(f"{path} is damaged: the covariance does not fit the unknowns. {MAKE}")
    return whole

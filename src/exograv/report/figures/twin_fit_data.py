"""Figures of a fitted twin, for its page and for `--json`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class FittedParameter:
    """Parameter of a joint, with what the recordings tell about it."""

    joint: str
    parameter: str
    unit: str
    estimate: float
    ci95: tuple[float, float]
    prior: float
    """Value of the data sheet, or usual value of such drives."""
    prior_sd: float
    learned: float
    """1 if the recordings tell all about it, 0 if its interval is that of the data sheet: 1 − sd after / sd before."""


@dataclass(frozen=True)
class AxisInertia:
    """Inertia about a joint's axis with all joints at zero: rotor and links together."""

    joint: str
    inertia_kgm2: float
    inertia_ci95_kgm2: tuple[float, float]


@dataclass(frozen=True)
class JointResiduals:
    """Residual torque of a joint on the held-out part of the recordings."""

    joint: str
    law: str
    rms_Nm: float
    noise_Nm: float
    over_noise: float
    slow_rms_Nm: float
    """Residual below 7 Hz, where most of the noise is filtered away."""
    fitted_rms_Nm: float
    """Residual on the part to which these parameters were fitted."""
    moved_s: float


@dataclass(frozen=True)
class LawScore:
    """Law of friction that was compared at a joint."""

    law: str
    excess: float
    """Mean logarithm of the held-out loss over that of the best law."""
    excess_sd: float


@dataclass(frozen=True)
class JointFriction:
    """Friction of a joint without load, by its speed, and the laws that were compared."""

    joint: str
    law: str
    v_rad_s: Sequence[float]
    torque_Nm: Sequence[float]
    ci95_Nm: Sequence[tuple[float, float]]
    measured_v_rad_s: Sequence[float]
    measured_Nm: Sequence[float]
    """Friction that held-out motion shows, as medians of bins of the speed."""
    laws: Sequence[LawScore]


@dataclass(frozen=True)
class GearFigures:
    """Elasticity of a joint's gear."""

    joint: str
    compliance_mrad_per_Nm: float
    ci95_mrad_per_Nm: tuple[float, float]


@dataclass(frozen=True)
class WarmGain:
    """Change of a joint's gain with the temperature of its motor."""

    joint: str
    percent_per_C: float | None
    """Change of the gain over the gain, per degree; None if the recordings do not tell it."""
    ci95_percent_per_C: tuple[float, float] | None
    temperature_C: tuple[float, float] | None
    """Lowest and highest temperature in the recordings; None without temperatures."""


@dataclass(frozen=True)
class CuffFigures:
    """Stiffness of the cuffs over that in `rig.toml`, by an arm in the machine."""

    direction: str
    """`translation` or `rotation`."""
    factor: float
    ci95: tuple[float, float]
    learned: float
    """1 − standard deviation after the recordings / before them."""


@dataclass(frozen=True)
class ExpectedGain:
    """Parameter, and what the designed motion is expected to tell about it."""

    joint: str
    parameter: str
    sd_ratio: float
    """Expected standard deviation after one period of the motion over that before."""


@dataclass(frozen=True)
class FurtherMotion:
    """Motion that is designed to tell most about the least known parameters."""

    file: Path
    period_s: float
    expected: Sequence[ExpectedGain]
    """All parameters; that with the largest expected gain comes first."""


@dataclass(frozen=True)
class TwinFigures:
    """Content of the page of a fitted twin."""

    rig: str
    side: str
    recordings: Sequence[str]
    recorded_s: float
    held_out_s: float
    is_simulated: bool
    """True if a recording is of the simulated machine."""
    held_out: Sequence[JointResiduals]
    friction: Sequence[JointFriction]
    parameters: Sequence[FittedParameter]
    axis_inertia: Sequence[AxisInertia]
    delay_ms: float | None
    delay_ci95_ms: tuple[float, float] | None
    bandwidth_Hz: Sequence[float | None]
    gears: Sequence[GearFigures]
    """Gears whose motors have their own encoders."""
    has_motor_encoders: bool
    """True if the recordings hold positions of all motors that are no copies of the joints' positions."""
    gain_by_temperature: Sequence[WarmGain]
    cuffs: Sequence[CuffFigures]
    """Cuffs, if a recording with an arm in the machine tells them."""
    warnings: Sequence[str]
    further_motion: Sequence[str]
    """Motions that would tell what these recordings do not."""
    designed_motion: FurtherMotion

"""True values of a hidden machine, drawn from a seed. The figures are those of the twin's levels 1 to 3 at most."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .engine import JOINTS, SHAPES, SLIPS, Engine, Joints, Values
from .geometry import Geometry

Wrench = Float[np.ndarray, " 6"]
"""Force [N] and moment [N·m]."""


class Stream(IntEnum):
    """Number beside the seed of each random stream of a machine. The machine itself is drawn without a number."""

    SENSORS = 1
    MOTION = 2
    FORCE_SENSOR = 3
    FORCE_NOISE = 4
    OPERATOR = 5
    UNPULLED_MOTION = 6
    PULLED_MOTION = 7


PERIOD_S, SUBSTEPS = 1e-3, 8
FORCE_SCALE_SD = 0.0075
"""Standard deviation of the scale of a force sensor [-]: between 0.5 and 1 %, as of usual six-axis sensors."""
FORCE_NOISE = np.repeat([0.1, 0.005], 3)
"""Noise of a force sensor per tick, forces [N] and moments [N·m]."""
FORCE_BIAS_SD = np.repeat([0.1, 0.005], 3)
"""Residual bias after taring, forces [N] and moments [N·m]."""
G = 9.81
STANDSTILL_RAD = 1e-3
"""Order of the deflection at which a joint that rests begins to slide [rad]."""


@dataclass(frozen=True)
class Sensing:
    """Errors of the measurements of a machine."""

    encoder_step: float
    """Step of the joint encoders [rad]."""
    encoder_noise: float
    """Noise of the joint encoders [rad]."""
    encoder_offset: Joints
    motor_offset: Joints | None
    """Offsets of the encoders on the motors [rad]; None if there are none."""
    current_noise: Joints
    """Standard deviation of a current measurement [A]."""


@dataclass(frozen=True)
class ForceSensing:
    """Errors of the six-axis force sensor at the calibration mount."""

    scale: float
    """Measured over true force and moment [-]."""
    bias: Wrench
    """Measured force [N] and moment [N·m] without load, after taring."""
    noise: Wrench
    """Standard deviation per tick."""


@dataclass(frozen=True)
class Hidden:
    """Hidden machine: the values of its equations, and the errors of its sensors."""

    seed: int
    values: Values
    sensing: Sensing

    @property
    def delay_s(self) -> float:
        """Time from a command's instant to the first measurement that shows the command, without bandwidth [s]."""
        return float(self.values["command_delay"] + self.values["sensor_delay"])

    @property
    def force_sensing(self) -> ForceSensing:
        """Errors of the force sensor, by a random stream of its own: older seeds draw the same machines as before."""
        rng = np.random.default_rng((self.seed, Stream.FORCE_SENSOR))
        scale = 1.0 + FORCE_SCALE_SD * float(rng.normal())
        return ForceSensing(scale, FORCE_BIAS_SD * rng.normal(size=6), FORCE_NOISE)

    def disclose(self, path: Path, mean_gain: Mapping[str, Joints]) -> None:
        """Write all true values into a JSON file, with the mean gain in each recording [N·m/A] by its name."""
        sensing, force = (
            {name: _plain(value) for name, value in vars(each).items()} for each in (self.sensing, self.force_sensing)
        )
        values = {name: np.asarray(value).tolist() for name, value in self.values.items()}
        gains = {name: gain.tolist() for name, gain in mean_gain.items()}
        told = {"seed": self.seed, "sensing": sensing, "force_sensing": force, "mean_gain": gains, "values": values}
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(told, indent=1), encoding="utf-8")

    @classmethod
    def disclosed(cls, path: Path) -> "Hidden":
        """Read a file of `disclose`."""
        held = json.loads(path.read_text(encoding="utf-8"))
        sensing: dict[str, Any] = {
            name: np.array(value) if isinstance(value, list) else value for name, value in held["sensing"].items()
        }
        values = {name: np.array(held["values"][name], dtype=float) for name in SHAPES}
        return cls(held["seed"], values, Sensing(**sensing))


def disclosed_mean_gain(path: Path) -> dict[str, Joints]:
    """Read the mean gain in each recording [N·m/A] from a file of `Hidden.disclose`, by the recording's name."""
    held = json.loads(path.read_text(encoding="utf-8"))
    return {name: np.array(gain, dtype=float) for name, gain in held["mean_gain"].items()}


def _plain(value: float | np.ndarray | None) -> float | list[float] | None:
    return value.tolist() if isinstance(value, np.ndarray) else value


def draw(geometry: Geometry, nominal_gain: Joints, seed: int) -> Hidden:
    """Draw a machine of this geometry, whose data sheet states `nominal_gain` [N·m/A]."""
    rng = np.random.default_rng(seed)

    def uniform(low: float, high: float) -> Joints:
        return rng.uniform(low, high, JOINTS)

    def deviating(shape: tuple[int, ...]) -> Float[np.ndarray, "..."]:
        return 1.0 + rng.choice([-1.0, 1.0], shape) * rng.uniform(0.1, 0.4, shape)

    gain = nominal_gain * (1.0 + np.clip(rng.normal(0.0, 0.06, JOINTS), -0.15, 0.15))
    coulomb, rotor = uniform(1.2, 3.2), uniform(0.1, 0.4)
    coulomb[3] *= 0.8
    bristle = coulomb / (STANDSTILL_RAD * uniform(0.4, 1.5))
    is_slip, bends = bool(rng.integers(2)), bool(rng.integers(2))
    is_second_order = bool(rng.integers(2))
    tilt = np.deg2rad(rng.normal(0.0, 0.4, 2))
    shares = rng.dirichlet(np.full(SLIPS, 3.0))
    mass, com, inertia = _links(geometry, deviating, rng)
    values = {
        "axis": geometry.axis,
        "origin": geometry.origin,
        "rotation": geometry.rotation,
        "mass": mass,
        "com": com,
        "inertia": inertia,
        "gravity": G * np.array([*np.sin(tilt), -np.sqrt(1.0 - float(np.sum(np.sin(tilt) ** 2)))]),
        "rotor": rotor,
        "stiffness": uniform(9e3, 40e3),
        "gear_damping": uniform(15.0, 40.0),
        "gain": gain,
        "gain_fall": uniform(0.0, 0.03),
        "current_warm": 0.5 * np.array([20.0, 20.0, 10.0, 10.0]) / nominal_gain,
        "winding_s": np.array(rng.uniform(200.0, 600.0)),
        "current_rad_s": 2.0 * np.pi * uniform(25.0, 70.0),
        "current_ratio": uniform(0.6, 1.1) if is_second_order else np.zeros(JOINTS),
        "law": np.array(float(is_slip)),
        "coulomb": coulomb,
        "asymmetry": np.clip(rng.normal(0.0, 0.06, JOINTS), -0.15, 0.15),
        "breakaway": uniform(1.1, 1.5),
        "v_stribeck": uniform(0.02, 0.1),
        "exponent": uniform(0.6, 2.0),
        "load_share": uniform(0.02, 0.1),
        "load_from": uniform(0.2, 1.5),
        "bristle": bristle,
        "bristle_damping": 0.6 * np.sqrt(bristle * rotor),
        "slip_share": shares,
        # Springs that slip one after the other: the first at a tenth of the last one's deflection.
        "slip_stiffness": shares / np.geomspace(0.1, 1.0, SLIPS),
        "viscous": uniform(0.3, 0.9) if bends else uniform(0.1, 0.4),
        "eyring": uniform(0.3, 0.9) if bends else np.zeros(JOINTS),
        "eyring_speed": uniform(0.1, 0.4),
        "power": np.zeros(JOINTS) if bends else uniform(0.5, 1.5),
        "power_exponent": uniform(0.5, 0.9),
        "ripple": uniform(0.02, 0.12),
        "ripple_waves": 2.0 * np.array([100.0, 100.0, 100.0, 100.0]),
        "ripple_phase": uniform(0.0, 2.0 * np.pi),
        "warm_fall": uniform(0.05, 0.2),
        "warm_s": np.array(rng.uniform(300.0, 900.0)),
        "lower": geometry.lower - np.deg2rad(3.0),
        "upper": geometry.upper + np.deg2rad(3.0),
        "stop_stiffness": np.array(500.0),
        "stop_damping": np.array(20.0),
        "drive_gain": nominal_gain,
        "command_delay": np.array(rng.uniform(0.3e-3, 2.0e-3)),
        "sensor_delay": np.array(rng.uniform(0.1e-3, 1.2e-3)),
        "period": np.array(PERIOD_S),
        "substeps": np.array(float(SUBSTEPS)),
    }
    step = 2.0 * np.pi / 2.0 ** int(rng.integers(16, 20))
    sensing = Sensing(
        step,
        float(rng.uniform(0.3, 1.0)) * step,
        np.deg2rad(rng.normal(0.0, 0.2, JOINTS)),
        np.deg2rad(rng.normal(0.0, 0.2, JOINTS)) if rng.integers(2) else None,
        uniform(0.1, 0.5) / nominal_gain,
    )
    return Hidden(seed, values, sensing)


def _links(
    geometry: Geometry, deviating: Callable[[tuple[int, ...]], np.ndarray], rng: np.random.Generator
) -> tuple[Joints, np.ndarray, np.ndarray]:
    """Draw masses, centres and inertias that differ from the file by 10 to 40 %, of bodies that can exist."""
    mass = geometry.mass * deviating((JOINTS,))
    way = rng.normal(size=(JOINTS, 3))
    way *= np.linalg.norm(geometry.com, axis=1, keepdims=True) / np.linalg.norm(way, axis=1, keepdims=True)
    com = geometry.com + rng.uniform(0.1, 0.4, (JOINTS, 1)) * way
    inertia = np.empty((JOINTS, 3, 3))
    for link, nominal in enumerate(geometry.inertia):
        # A stretched body has a second moment of mass that stays positive, so that its inertia is possible.
        second = 0.5 * np.trace(nominal) * np.eye(3) - nominal
        stretch = np.diag(np.sqrt(deviating((3,)) * mass[link] / geometry.mass[link]))
        stretched = stretch @ second @ stretch
        inertia[link] = np.trace(stretched) * np.eye(3) - stretched
    return mass, com, inertia


def truth_engine(hidden: Hidden) -> Engine:
    """Return the equations of a disclosed machine at zero position."""
    return Engine(hidden.values, np.zeros(JOINTS))

"""Discrepancy of a machine's model: its size by held-out residuals, and its effect on the covariance of a fit.

A fit that counts residuals as noise becomes more certain with every sample. A gain that depends on the angle or the
temperature of a motor, and a friction law of another form, make the same error in every pass. Random fields per joint
are therefore considered, not estimated: torque over posture; friction over the joint's angle; and a part of the
torque over the joint's angle and over time.

The fit absorbs a part of each field, and only the rest is seen. With E the values of a field at one standard deviation,
J the derivative of the model and W the weights of the fit, the rest is E − J P JᵀW E. The size of a field is the one
whose rest has the variance of the held-out residuals beyond the noise of the sensors:

    size² = mean(r² − noise²) / mean(|E − J P JᵀW E|²)

Held-out residuals do not tell whether an error is additive or proportional to the torque: each of the two alone may
explain them. Both explanations count as equally likely, so that each contributes half of its variance.

Errors of a force sensor are considered in the same way: one error of its scale, and a constant force after taring.

Source: Schmidt 1966 (considered parameters); Kennedy & O'Hagan 2001, JRSS B 63:425 (discrepancy).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit, Sweeps
from exograv.identification.core.discrepancy import POSTURE_LENGTH_RAD

FEATURES = 32
"""Number of random features of each field [-]."""

ANGLE_LENGTH_RAD = 1.0
"""Correlation length over the joint's angle [rad]: that of an error with one wave per turn, such as an eccentricity."""

TIME_LENGTH_S = 60.0
"""Correlation length over time [s]: motors warm up over some minutes."""

FORCE_SCALE_SD = 0.01
"""Standard deviation of the scale of a force sensor [-]. Assumed."""

FORCE_BIAS_N = 0.3
"""Standard deviation of the force that a sensor shows after taring, by drift, along each axis [N]. Assumed."""

SEED = 34

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class DiscrepancySize:
    """Standard deviations of the model's errors beyond the noise of the sensors, by either explanation alone."""

    additive_Nm: Joints
    """Error of the nominal torque if it does not depend on the torque [N·m]."""

    proportional: Joints
    """The same error if it is proportional to the torque [-]."""


@dataclass(frozen=True)
class _Fields:
    """Fields of one joint at its clear samples, at one standard deviation of additive and proportional error."""

    additive: Float[np.ndarray, "sample field"]
    proportional: Float[np.ndarray, "sample field"]


class Considered:
    """Fields of all joints at the samples of a recording, and their effect on fits to these samples."""

    def __init__(self, model: EmptyMachine, sweeps: Sweeps):
        draw, torque = np.random.default_rng(SEED), model.description.nominal_gain * sweeps.current
        self._model, self._sweeps, self._clear = model, sweeps, sweeps.clear
        self._fields = list[_Fields]()
        for joint, clear in enumerate(self._clear.T):
            angle, t = sweeps.q[clear, joint, None] / ANGLE_LENGTH_RAD, sweeps.t[clear, None] / TIME_LENGTH_S
            direction, load = np.sign(sweeps.v[clear, joint, None]), torque[clear, joint, None]
            posture = _features(sweeps.q[clear] / POSTURE_LENGTH_RAD, draw)
            friction, by_angle, by_time = direction * _features(angle, draw), _features(angle, draw), _features(t, draw)
            # Each size is that of two fields together.
            additive = np.hstack([posture, friction]) / np.sqrt(2.0)
            self._fields.append(_Fields(additive, load * np.hstack([by_angle, by_time]) / np.sqrt(2.0)))

    def size(self, fit: Fit, seen: Bool[np.ndarray, " sample"], noise_Nm: Joints, t_end: float) -> DiscrepancySize:
        """Size of the fields by the samples that a fit has not seen.

        Args:
            fit: Fit to the samples that are `seen`.
            seen: True for the samples of the fit.
            noise_Nm: Standard deviation of the sensors' noise in a sample, of the nominal torque [N·m].
            t_end: Time from which the ages of the fit count back [s].
        """
        left, derivative = self._model.residual(self._sweeps, fit.theta, t_end), self._derivative(fit)
        sizes = np.zeros((2, len(self._fields)))
        for joint, (clear, fields) in enumerate(zip(self._clear.T, self._fields, strict=True)):
            used, slope, errors = seen[clear], derivative[joint][:, clear], left[clear, joint]
            beyond = max(float(np.mean(np.square(errors[~used]))) - float(noise_Nm[joint]) ** 2, 0.0)
            for kind, of_kind in enumerate((fields.additive, fields.proportional)):
                effect = fit.covariance @ (_weight(fit)[joint] * slope[:, used] @ of_kind[used])
                rest = np.square(of_kind[~used] - slope[:, ~used].T @ effect).sum(axis=1)
                sizes[kind, joint] = np.sqrt(beyond / np.mean(rest))
        return DiscrepancySize(*sizes)

    def covariance(self, fit: Fit, size: DiscrepancySize) -> Float[np.ndarray, "unknown unknown"]:
        """Covariance of a fit to all samples, with the effect of the fields: P + Σ_j A_j A_jᵀ, A_j = P JᵀW E_j.

        The errors of a force sensor act on all joints at once: their A is the sum over the joints.
        """
        derivative, covariance = self._derivative(fit), fit.covariance.copy()
        for joint, (clear, fields) in enumerate(zip(self._clear.T, self._fields, strict=True)):
            additive, proportional = np.sqrt(0.5) * np.array([size.additive_Nm[joint], size.proportional[joint]])
            errors = np.hstack([additive * fields.additive, proportional * fields.proportional])
            effect = fit.covariance @ (_weight(fit)[joint] * derivative[joint][:, clear] @ errors)
            covariance += effect @ effect.T
        if self._sweeps.wrench is not None:
            of_sensor = np.zeros((len(covariance), 4))
            for joint, (clear, errors) in enumerate(zip(self._clear.T, self._sensor_errors(fit), strict=True)):
                of_sensor += fit.covariance @ (_weight(fit)[joint] * derivative[joint][:, clear] @ errors[clear])
            covariance += of_sensor @ of_sensor.T
        return covariance

    def _sensor_errors(self, fit: Fit) -> Float[np.ndarray, "joint sample 4"]:
        """Nominal torque by errors of the force sensor of one standard deviation: scale, and force by axis [N·m]."""
        wrench, t_end = self._sweeps.wrench, float(self._sweeps.t[-1])
        assert wrench is not None
        is_measured = (wrench != 0.0).any(axis=1, keepdims=True)  # A recording may have no sensor.
        shifts = [FORCE_SCALE_SD * wrench, *(is_measured * bias for bias in FORCE_BIAS_N * np.eye(3, wrench.shape[1]))]
        right = self._model.residual(self._sweeps, fit.theta, t_end)
        wrong = [
            self._model.residual(replace(self._sweeps, wrench=wrench + shift), fit.theta, t_end) for shift in shifts
        ]
        return np.stack([one - right for one in wrong]).transpose(2, 1, 0)

    def _derivative(self, fit: Fit) -> Float[np.ndarray, "joint unknown sample"]:
        return self._model.derivative(self._sweeps, fit.theta)


def _weight(fit: Fit) -> Joints:
    """Weight of a sample in a fit: inverse variance over the number of samples within the correlation time."""
    return 1.0 / (np.square(fit.noise.sd) * np.maximum(fit.noise.correlation_s / SAMPLE_PERIOD_S, 1.0))


def _features(x: Float[np.ndarray, "sample axis"], draw: np.random.Generator) -> Float[np.ndarray, "sample feature"]:
    """Random Fourier features of a field with variance and length 1.

    Source: Rahimi & Recht 2007, NeurIPS 20.
    """
    frequencies, phases = draw.standard_normal((x.shape[1], FEATURES)), draw.uniform(0.0, 2.0 * np.pi, FEATURES)
    return np.sqrt(2.0 / FEATURES) * np.cos(x @ frequencies + phases)

"""Check of the arm's weight against the table, for the person on the form.

Every body mass predicts an arm, with the table's spread. The motion gives the probability of several hypotheses: the
mass on the form is right, kilograms and pounds were mixed up, or the form belongs to another person. The most probable
one wins.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import softmax

from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import disturbance_sd, prior
from exograv.identification.core.square_root import square_root

from .motion_samples import SAMPLE_S
from .slow_torque import Belief, Information, RegressionRows, believed, motion_information

POUNDS_PER_KG = 2.2046
SHARES = {"form": 1.0, "pounds": 1.0 / POUNDS_PER_KG, "kilograms": POUNDS_PER_KG}
"""True body mass as a share of the mass on the form: right, typed in pounds, or converted to kilograms twice."""
PEOPLE_KG, PEOPLE_LOG_SD = 75.0, 0.2  # adults' body mass, of either sex
SOMEBODY_ELSE = 0.01
"""Prior probability of another person's form against the right one. A false alarm costs only a second look at the form;
another person's form is rare, and identification will find the arm in any case. Mixed-up units are as rare, but the
arm would be lifted with twice or half its weight. That is a hundred times worse, so it counts as much as the form.
"""

KG = np.geomspace(25.0, 250.0, 47)
"""Body masses that are compared with the arm [kg]."""

STEPS = 2  # Gauss-Newton steps

SURE = 0.99
"""Probability of the verdict at which the check may end, because more motion would hardly change the verdict [-]."""


RESTLESS_TEXT = "The person does not relax: the form cannot be checked. Ask the person to let go, then repeat."


@dataclass(frozen=True)
class ArmCheck:
    """Mass of the arm, and the verdict about the form."""

    arm_mass: float
    """Estimated mass of the arm [kg]."""

    sd: float
    """Standard deviation of `arm_mass` [kg]."""

    like_kg: float
    """Body mass that fits this arm best [kg]."""

    refused: bool
    why: str
    """Verdict as a sentence for the operator."""

    probability: float
    """Probability of the verdict against the other hypotheses [-]."""

    @property
    def is_sure(self) -> bool:
        """True if more motion would hardly change the verdict."""
        return self.probability >= SURE

    @property
    def ci95(self) -> tuple[float, float]:
        """Interval of 95 % of the arm's mass [kg]."""
        return self.arm_mass - 1.96 * self.sd, self.arm_mass + 1.96 * self.sd


class ArmJudge:
    """Judge that compares a motion with the table."""

    def __init__(self, model: ArmModel):
        self._model, assembly, machine = model.again(), model.assembly, model.machine
        self._layout = ParameterLayout.of(assembly)
        self._mean, covariance = prior(assembly, machine)
        phi = self._layout.phi
        bodies = square_root(covariance[phi, phi])
        rest = covariance.copy()
        rest[phi, phi] = 0.0
        others = square_root(rest)
        # The arm's own unknowns come first: only they depend on the body mass.
        self._bodies = bodies.shape[1]
        self._spread = np.hstack([np.vstack([bodies, np.zeros((len(self._mean) - phi.stop, self._bodies))]), others])
        self._sd = disturbance_sd(assembly.description.places)
        self._field = Discrepancy(machine.residual_sd, POSTURE_LENGTH_RAD, FEATURES)
        self._unknowns = self._spread.shape[1] + self._field.count
        # The table's arm in these unknowns; its negative is an arm without mass.
        self._table, *_ = np.linalg.lstsq(bodies, self._mean[phi], rcond=None)

    def judge(self, motions: Sequence[Sequence[Sample]], body_mass_kg: float) -> ArmCheck:
        """Return the verdict from motions, with pauses between them, and the body mass on the form [kg]."""
        x, expected = self._mean, None
        information: list[Information] = []
        for _ in range(STEPS):
            information = motion_information([self._rows(samples, x) for samples in motions], self._sd, expected)
            expected = self._belief(information, 1.0).mean
            x = self._mean + self._spread @ np.clip(expected[: self._spread.shape[1]], -2.0, 2.0)
        evidence = np.array([self._belief(information, kg / body_mass_kg).log_evidence for kg in KG])
        like_kg = float(KG[int(np.argmax(evidence))])
        hypotheses = self._hypotheses(information, evidence, body_mass_kg)
        winner = max(hypotheses, key=lambda name: hypotheses[name])
        share = SHARES.get(winner, like_kg / body_mass_kg)
        mass, sd = self._mass(self._belief(information, share))
        why, probability = _sentence(winner, like_kg, body_mass_kg), float(softmax(list(hypotheses.values())).max())
        return ArmCheck(mass, sd, like_kg, winner != "form", why, probability)

    def _hypotheses(
        self, information: Sequence[Information], evidence: Float[np.ndarray, " kg"], body_mass_kg: float
    ) -> dict[str, float]:
        """Log probability of each hypothesis, up to a constant."""
        people = np.exp(-0.5 * (np.log(KG / PEOPLE_KG) / PEOPLE_LOG_SD) ** 2)
        anybody = evidence.max() + np.log(np.exp(evidence - evidence.max()) @ people / people.sum())
        found = {name: self._belief(information, share).log_evidence for name, share in SHARES.items()}
        return {**found, "somebody else": float(anybody + np.log(SOMEBODY_ELSE))}

    def _belief(self, information: Sequence[Information], share: float) -> Belief:
        """Belief for a person of `share` times the mass on the form.

        The table's spread is relative, so it scales, too.
        """
        mean, variance = np.zeros(self._unknowns), np.ones(self._unknowns)
        mean[: self._bodies] = (share - 1.0) * self._table
        variance[: self._bodies] = share**2
        return believed(information, mean, variance)

    def _mass(self, belief: Belief) -> tuple[float, float]:
        """Mass of the first arm, and its standard deviation [kg]."""
        segments = len(self._layout.bodies) // self._layout.arms
        masses = np.zeros(len(self._mean))
        masses[[body.start for body in self._layout.bodies[:segments]]] = 1.0
        known = slice(0, self._spread.shape[1])
        row = masses @ self._spread
        return (
            float(masses @ self._mean + row @ belief.mean[known]),
            float(np.sqrt(row @ belief.covariance[known, known] @ row)),
        )

    def _rows(self, samples: Sequence[Sample], x: Parameters) -> RegressionRows:
        self._model.restart()
        machine, rows = self._model.machine, []
        repeats = np.maximum(machine.correlation_s / SAMPLE_S, 1.0)
        for sample in samples:
            tau, derivative = self._model.linearise(sample, x)
            noise = np.hypot(machine.residual_sd * np.sqrt(repeats), self._model.direction_uncertainty(sample.v))
            y = sample.tau - tau + derivative @ (x - self._mean)
            rows.append((np.hstack([derivative @ self._spread, self._field.errors(sample.q, sample.v)]), y, noise))
        H, y, noise = (np.array(column) for column in zip(*rows, strict=True))
        return RegressionRows(np.array([sample.t for sample in samples]), H, y, noise)


def _sentence(winner: str, like_kg: float, typed_kg: float) -> str:
    weighs = f"The arm weighs like that of a person of {like_kg:.0f} kg, not {typed_kg:.0f} kg"
    return {
        "form": f"The arm may be that of a person of {typed_kg:.0f} kg, as on the form; best fits {like_kg:.0f} kg.",
        "pounds": f"{weighs}. The mass may have been typed in pounds. Check body mass.",
        "kilograms": f"{weighs}. A mass in kilograms may have been converted to kilograms again. Check body mass.",
        "somebody else": f"{weighs}. This may be another person's form. Check name and body mass.",
    }[winner]


def in_doubt_not_refused(check: ArmCheck, is_restless: bool) -> ArmCheck:
    """Return the verdict. A doubtful verdict on a person who does not relax becomes a request to relax."""
    if check.is_sure or not is_restless:
        return check
    return replace(check, refused=False, why=f"{RESTLESS_TEXT} {check.why}")

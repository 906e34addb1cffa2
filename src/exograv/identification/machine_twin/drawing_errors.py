"""Size of the errors of a machine's drawings, by the evidence of the recordings.

The prior of a calibration trusts the drawings of the links to some percent. The links of a machine whose parts were
replaced, or guessed, may be far off. The prior with the largest evidence is used (empirical Bayes, Laplace's method).

Source: MacKay 1992, Neural Computation 4:415.
"""

import numpy as np

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit, Sweeps
from exograv.identification.calibration.empty_prior import EmptyPrior

SCALES = (1.0, 3.0, 10.0)
"""Errors of the drawings that are compared, over the usual ones [-]: 4, 12 and 40 % of a link's mass."""


def with_link_errors(prior: EmptyPrior, scale: float) -> EmptyPrior:
    """Return the prior with this multiple of the usual errors of the links' drawings."""
    links, covariance = prior.layout.links, prior.covariance.copy()
    covariance[links, links] *= scale**2
    return EmptyPrior(prior.layout, prior.mean, covariance)


def likely_link_errors(model: EmptyMachine, sweeps: Sweeps) -> float:
    """Return the scale of the drawings' errors with the largest evidence."""
    loosest = with_link_errors(model.prior, max(SCALES))
    first = model.fit(sweeps, loosest, model.fit(sweeps, loosest))
    evidence = {}
    for scale in SCALES:
        fit = model.fit(sweeps, with_link_errors(model.prior, scale), first)
        evidence[scale] = _log_evidence(model, sweeps, fit, first)
    return max(evidence, key=lambda scale: evidence[scale])


def _log_evidence(model: EmptyMachine, sweeps: Sweeps, fit: Fit, first: Fit) -> float:
    """Logarithm of the evidence of a fit's prior, up to a constant that all fits with the noise of `first` share."""
    left = model.residual(sweeps, fit.theta, float(sweeps.t[-1]))
    repeats = np.maximum(first.noise.correlation_s / SAMPLE_PERIOD_S, 1.0)
    misfit = np.where(sweeps.clear, left / (first.noise.sd * np.sqrt(repeats)), 0.0)
    off = fit.theta - fit.prior.mean
    far = float(off @ np.linalg.solve(fit.prior.covariance, off))
    after, before = (float(np.linalg.slogdet(one)[1]) for one in (fit.covariance, fit.prior.covariance))
    return -0.5 * (float((misfit**2).sum()) + far) + 0.5 * (after - before)

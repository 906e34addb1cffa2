"""Identification methods for any torque model, by name; every method is built from the same `Setting`."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from exograv.identification.core.instrument import Instrumented
from exograv.identification.core.interface import Method, TorqueModel
from exograv.identification.core.setting import Setting
from exograv.identification.core.tissue import TissueModel
from exograv.identification.recursive.recursive import Recursive

from .baselines import adam, ekf, gradient_full, gradient_prior, kaczmarz, least_squares, nlms, oracle, rls

Builder = Callable[..., Method]


def _recursive(setting: Setting) -> Method:
    """Build the filter, with the hidden parameters of the wearer's tissue.

    Rows may be taken along the requested motion (`Instrumented`).
    """
    s = setting
    if s.springs is None:
        return Recursive(s.model, s.mean, s.covariance, s.noise, s.bodies, s.discrepancy)
    tissue = TissueModel(s.model, s.springs, s.mean)
    model: TorqueModel = tissue
    if s.again is not None:
        model = Instrumented(model, TissueModel(s.again(), s.springs, s.mean))
    return Recursive(model, s.mean, s.covariance, s.noise, s.bodies, s.discrepancy, tissue.hidden)


BUILDERS: Mapping[str, Builder] = MappingProxyType(
    {
        "recursive": _recursive,
        "gradient-full": gradient_full.GradientFull,
        "adam": adam.Adam,
        "gradient-prior": gradient_prior.GradientPrior,
        "nlms": nlms.Nlms,
        "kaczmarz": kaczmarz.Kaczmarz,
        "rls": rls.RecursiveLeastSquares,
        "ekf": ekf.LogCholeskyFilter,
        "least-squares": least_squares.LeastSquares,
        "oracle": oracle.OracleMethod,
    }
)
"""Builders by name of the method. Arguments: the setting, and the method's tuning if it has one."""

CANDIDATES: Mapping[str, tuple[Mapping[str, float], ...]] = MappingProxyType(
    {
        "gradient-full": gradient_full.CANDIDATES,
        "adam": adam.CANDIDATES,
        "gradient-prior": gradient_prior.CANDIDATES,
        "nlms": nlms.CANDIDATES,
        "rls": rls.CANDIDATES,
        "ekf": ekf.CANDIDATES,
        "kaczmarz": kaczmarz.CANDIDATES,
        "least-squares": least_squares.CANDIDATES,
    }
)
"""Tuning candidates of each method, nine at most. `recursive` and `oracle` have none: prior and noise set them."""


def built(name: str, setting: Setting, tuning: Mapping[str, Any] = MappingProxyType({})) -> Method:
    """Build the method with this name."""
    return BUILDERS[name](setting, **tuning)

"""All methods that serve any model, by name: each takes the same setting and makes of it what it can."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from . import adam, ekf, forgetting, gradient_full, gradient_prior, kaczmarz, least_squares, nlms, oracle
from .interface import Method
from .recursive import Recursive
from .setting import Setting

Builder = Callable[..., Method]


def _recursive(setting: Setting) -> Method:
    s = setting
    return Recursive(s.model, s.mean, s.covariance, s.noise, s.bodies, s.discrepancy)


def _gradient(setting: Setting, **tuning: float) -> Method:
    """The paper's on a robot, which has neither cuffs nor elasticity: plain descent on the robot's model."""
    return gradient_full.GradientFull(setting, name="gradient", **tuning)


BUILDERS: Mapping[str, Builder] = MappingProxyType(
    {
        "recursive": _recursive,
        "gradient": _gradient,
        "gradient-full": gradient_full.GradientFull,
        "adam": adam.Adam,
        "gradient-prior": gradient_prior.GradientPrior,
        "nlms": nlms.Nlms,
        "kaczmarz": kaczmarz.Kaczmarz,
        "rls": forgetting.Forgetting,
        "ekf": ekf.LogCholeskyFilter,
        "least-squares": least_squares.LeastSquares,
        "oracle": oracle.Oracle,
    }
)
"""From a setting, and where one is tuned the method's own setting, to the method."""


def built(name: str, setting: Setting, tuning: Mapping[str, Any] = MappingProxyType({})) -> Method:
    """The method of that name."""
    return BUILDERS[name](setting, **tuning)

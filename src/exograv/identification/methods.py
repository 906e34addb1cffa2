"""Identification methods for any torque model, by name; every method is built from the same `Setting`."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from exograv.identification.core.hidden_cuffs import CuffModel
from exograv.identification.core.instrument import Instrumented
from exograv.identification.core.interface import Method, TorqueModel
from exograv.identification.core.muscle_signals import MuscleModel
from exograv.identification.core.setting import Setting
from exograv.identification.core.tissue import Hidden, TissueModel
from exograv.identification.recursive.recursive import Recursive

from .baselines import adam, ekf, gradient_full, gradient_prior, kaczmarz, least_squares, nlms, oracle, rls

Builder = Callable[..., Method]


def _recursive(setting: Setting) -> Method:
    """Build the filter, with the hidden parameters of the wearer's tissue and cuffs.

    Rows may be taken along the requested motion (`Instrumented`).
    """
    s = setting
    model, hidden = with_hidden(s.model, s)
    model = instrumented(model, hidden, s)
    return Recursive(model, s.mean, s.covariance, s.noise, s.bodies, s.discrepancy, hidden, s.path)


def instrumented(model: TorqueModel, hidden: Hidden | None, setting: Setting) -> TorqueModel:
    """Return the model that can take its rows along the requested motion, where the setting has a second model."""
    if setting.again is None or hidden is None:
        return model
    return Instrumented(model, with_hidden(setting.again(), setting)[0])


def with_hidden(model: TorqueModel, setting: Setting) -> tuple[TorqueModel, Hidden | None]:
    """Return the model with hidden parameters of tissue, cuffs and muscles, and their prior.

    The prior is None if the setting has none of them.
    """
    if setting.springs is None:
        return _with_muscles(model, None, setting)
    tissue = TissueModel(model, setting.springs)
    if setting.cuffs is None:
        return _with_muscles(tissue, tissue.hidden, setting)
    cuffs = CuffModel(model, tissue, setting.cuffs)
    return _with_muscles(cuffs, cuffs.hidden, setting)


def _with_muscles(model: TorqueModel, hidden: Hidden | None, setting: Setting) -> tuple[TorqueModel, Hidden | None]:
    if setting.muscles is None:
        return model, hidden
    torque_at = None if setting.springs is None else setting.springs.offset
    muscles = MuscleModel(model, hidden, setting.muscles, torque_at)
    return muscles, muscles.hidden


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

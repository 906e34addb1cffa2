"""Names of methods, torque sources and motions on the command line."""

from typing import Literal

from exograv.errors import ConfigError

MethodName = Literal[
    "recursive",
    "gradient",
    "gradient-full",
    "adam",
    "gradient-prior",
    "nlms",
    "kaczmarz",
    "rls",
    "ekf",
    "least-squares",
    "oracle",
    "anthropometric",
    "average",
    "full",
    "equilibrium",
]
"""Identification methods; docs/explanation/identification_methods.md describes each."""

WITH_UNCERTAINTY: frozenset[MethodName] = frozenset({"recursive", "rls", "ekf", "oracle", "anthropometric"})
"""Methods that state the uncertainty of their estimate while the motion goes on."""

TorqueSourceName = Literal["current", "commanded"]

MotionName = Literal["designed", "adaptive", "fourier", "fixed"]
"""Motion of the arm during identification (docs/explanation/excitation.md): the machine's own motion, pieces planned
on the way for the parameters that are still uncertain, D-optimal harmonics, or one joint after the other.
"""


def refuse_without_uncertainty(option: str, method: MethodName) -> None:
    """Check before a run that the method states the uncertainty that an option needs.

    Raises:
        ConfigError: The method states no uncertainty.
    """
    if method not in WITH_UNCERTAINTY:
        raise ConfigError(
            f"{option} needs a method that states its uncertainty; '{method}' does not. Use --method recursive, or "
            f"leave out {option}."
        )

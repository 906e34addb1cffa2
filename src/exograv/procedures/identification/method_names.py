"""Names of methods, torque sources and motions on the command line."""

from typing import Literal

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

TorqueSourceName = Literal["current", "commanded"]

MotionName = Literal["designed", "adaptive", "fourier", "fixed"]
"""Motion of the arm during identification (docs/explanation/excitation.md): the machine's own motion, pieces planned
on the way for the parameters that are still uncertain, D-optimal harmonics, or one joint after the other.
"""

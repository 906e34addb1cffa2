"""The words of the command line."""

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
"""Identification methods; docs/identification_methods.md says what each is."""

TorqueSourceName = Literal["current", "commanded"]

MotionName = Literal["designed", "adaptive", "fourier", "fixed"]
"""What moves the arm while it is identified: the machine's own motion, pieces planned on the way from what is still
uncertain, D-optimal harmonics, or one joint after the other (docs/excitation.md)."""

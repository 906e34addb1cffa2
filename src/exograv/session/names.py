"""The words of the command line."""

from typing import Literal

MethodName = Literal["recursive", "gradient", "anthropometric"]
TorqueSourceName = Literal["current", "commanded"]

"""moteus controllers on CAN-FD, told a torque in every period (docs/moteus.md)."""

from .rig import MoteusRig as MoteusRig

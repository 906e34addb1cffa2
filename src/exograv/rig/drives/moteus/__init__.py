"""Driver of moteus controllers on CAN-FD, which take a torque in every period (docs/moteus.md)."""

from .rig import MoteusRig as MoteusRig

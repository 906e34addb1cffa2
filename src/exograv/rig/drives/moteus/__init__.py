"""Driver of moteus controllers on CAN-FD, which take a torque in every period (docs/howto/moteus.md)."""

from .rig import MoteusRig as MoteusRig

"""Driver of CANopen CiA 402 drives on a CAN bus, which take a torque in every period (docs/howto/canopen.md)."""

from .rig import CanopenRig as CanopenRig

"""Drives on a CAN bus that speak CANopen CiA 402, told a torque in every period (docs/canopen.md)."""

from .rig import CanopenRig as CanopenRig

"""Cyclic part of the CANopen driver in C."""

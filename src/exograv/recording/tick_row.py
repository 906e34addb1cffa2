"""Values of one tick in the order of the table of `/tick`."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from exograv.signals import Joints

from .encoding import TICK_DEFAULTS
from .schema import TICK

SCALARS = tuple(field.name for field in TICK.fields if not field.size and field.name != "phase")
"""Fields with one value, without the phase, which the writer adds."""

JOINT_FIELDS = tuple(field.name for field in TICK.fields if field.size)
"""Fields with one value per joint."""


class TickRow(NamedTuple):
    """Values of one tick, without its phase: meanings and units as in the table `tick_fields.TICK`.

    Scalars come first, and arrays (joint,) of float64 follow.
    """

    t: float
    now: float
    monotonic: float
    drive: float
    gravity_level: float
    arm_share: float
    closure_slope: float
    tick_us: float
    lateness_us: float
    safe_state: float
    sequence: float
    control: float
    seen: float
    faulty: float
    acts: float
    q_measured: Joints
    q_reference: Joints
    v_reference: Joints
    a_reference: Joints
    q_motor: Joints
    v: Joints
    current: Joints
    tau_measured: Joints
    tau_feedforward: Joints
    tau_desired: Joints
    tau_commanded: Joints


def tick_row(values: Mapping[str, Any], n_joints: int) -> TickRow:
    """Return a row from values by name; one value for all joints is allowed, and some fields have a default.

    Raises:
        ValueError: A value is missing or unknown.
    """
    values = TICK_DEFAULTS | dict(values)
    if values.keys() != set(TickRow._fields):
        raise ValueError(f"/tick needs {', '.join(TickRow._fields)}; given: {', '.join(values)}.")
    of_joints = [np.full(n_joints, values[name], dtype=float) for name in JOINT_FIELDS]
    return TickRow._make([*(values[name] for name in SCALARS), *of_joints])

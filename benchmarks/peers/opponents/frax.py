"""frax: rigid-body dynamics in JAX, joints in parallel instead of one after the other."""

import tempfile
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from exograv.dynamics.loop_torque import GRAVITY
from peers.tasks.interface import BatchShape, Call, Task, imported, only
from peers.tasks.urdf_text import urdf_text

from .jax_engine import jax_module, jitted, refuse_single_precision


class Frax:
    """`Robot.rnea`, jitted, and vmapped for batches."""

    name = "frax"

    def version(self) -> str:
        """Return the version of the package."""
        _frax()
        return version("frax")

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call; the model is read from a URDF file."""
        only(task, "rnea")
        refuse_single_precision(batch)
        jax_module()
        robot_class = _frax().Robot
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(action="ignore"):
            path = Path(folder) / "machine.urdf"
            path.write_text(urdf_text(task.tree))
            robot = robot_class(str(path), joint_ordering=list(task.tree.joint_names))
        upwards = np.concatenate([-GRAVITY, np.zeros(3)])
        return jitted(lambda q, v, a: [robot.rnea(q, v, a, upwards, None)], ("tau",), task, batch, axis=0)


def _frax() -> Any:
    # frax warns of JAX settings that `section_process` makes in the right place.
    with warnings.catch_warnings(action="ignore"):
        return imported("frax")

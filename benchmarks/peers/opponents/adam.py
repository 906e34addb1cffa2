"""adam: rigid-body dynamics of a floating base on several array packages; here the base is fixed."""

import warnings
from functools import partial
from importlib.metadata import version
from typing import Any

import casadi as ca
import numpy as np

from exograv.dynamics.loop_torque import GRAVITY
from exograv.kernel import virtual_machine
from peers.tasks.interface import BatchShape, Call, Task, copy_into, imported, only, only_single
from peers.tasks.urdf_text import urdf_text

from .jax_engine import jax_module, jitted, refuse_single_precision

BASE = 6
"""Freedoms of the floating base, which come first."""


class AdamCasadi:
    """CasADi backend on CasADi's virtual machine. It has no inverse dynamics: mass matrix times a, plus bias."""

    name = "adam (CasADi)"

    def version(self) -> str:
        """Return the version of the package."""
        imported("adam")
        return version("adam-robotics")

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call; the model is read from URDF text."""
        only(task, "rnea")
        only_single(batch)
        model = _model(imported("adam.casadi"), task)
        n = len(task.tree.joints)
        q, v, a = (ca.SX.sym(name, n) for name in ("q", "v", "a"))
        base = ca.SX.eye(4)
        mass = model.mass_matrix(base, q)
        tau = mass[BASE:, BASE:] @ a + model.bias_force(base, q, ca.SX.zeros(BASE), v)[BASE:]
        single = virtual_machine.compile(ca.Function("adam", [q, v, a], [tau], ["q", "v", "a"], ["tau"]))
        return Call(partial(copy_into, single.inputs), single.evaluate, lambda: single.outputs, (single,))


class AdamJax:
    """JAX backend, jitted, and vmapped for batches."""

    name = "adam (JAX)"

    def version(self) -> str:
        """Return the version of the package."""
        imported("adam")
        return version("adam-robotics")

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call; the model is read from URDF text."""
        only(task, "rnea")
        refuse_single_precision(batch)
        jax_module()
        model = _model(imported("adam.jax"), task)
        base, still = np.eye(4), np.zeros(BASE)

        def torque(q: Any, v: Any, a: Any) -> list[Any]:
            mass = model.mass_matrix(base, q)
            return [mass[BASE:, BASE:] @ a + model.bias_force(base, q, still, v)[BASE:]]

        return jitted(torque, ("tau",), task, batch, axis=0)


def _model(backend: Any, task: Task) -> Any:
    with warnings.catch_warnings(action="ignore"):
        return backend.KinDynComputations(
            urdf_text(task.tree), list(task.tree.joint_names), gravity=np.concatenate([GRAVITY, np.zeros(3)])
        )

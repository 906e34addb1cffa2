"""Pinocchio: hand-written C++ for any tree, from Python; the most common standard."""

from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np

from exograv.identification.calibration.empty_machine import V_REST
from peers.tasks.interface import BatchShape, Call, Missing, State, Task, copy_into, imported, only
from peers.tasks.urdf_text import urdf_text


class Pinocchio:
    """`rnea`, `computeJointTorqueRegressor`, `computeRNEADerivatives`, and `rneaInParallel` for batches."""

    name = "Pinocchio"

    def version(self) -> str:
        """Return the version of the package `pin`."""
        return version("pin")

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build a call; the model is read from URDF text."""
        only(task, "rnea", "regressor", "rnea_derivatives", "torque_gradient")
        pinocchio = imported("pinocchio")
        model = pinocchio.buildModelFromXML(urdf_text(task.tree))
        if batch is not None:
            return _in_parallel(pinocchio, model, task, batch)
        make = {
            "rnea": _rnea,
            "regressor": _regressor,
            "rnea_derivatives": _derivatives,
            "torque_gradient": _torque_gradient,
        }
        return make[task.quantity](pinocchio, model)


def _rnea(pinocchio: Any, model: Any) -> Call:
    data, inputs = model.createData(), _motion(model.nv)
    run = partial(pinocchio.rnea, model, data, *inputs.values())
    return Call(partial(copy_into, inputs), run, lambda: {"tau": run()}, (model, data))


def _regressor(pinocchio: Any, model: Any) -> Call:
    data, inputs = model.createData(), _motion(model.nv)
    run = partial(pinocchio.computeJointTorqueRegressor, model, data, *inputs.values())
    return Call(partial(copy_into, inputs), run, lambda: {"Y": run()}, (model, data))


def _derivatives(pinocchio: Any, model: Any) -> Call:
    data, inputs = model.createData(), _motion(model.nv)
    run = partial(pinocchio.computeRNEADerivatives, model, data, *inputs.values())

    def read() -> dict[str, np.ndarray]:
        return dict(zip(("dtau_dq", "dtau_dv", "dtau_da"), run(), strict=True))

    return Call(partial(copy_into, inputs), run, read, (model, data))


def _torque_gradient(pinocchio: Any, model: Any) -> Call:
    """Return the gradient Yᵀ · error, as torque is linear in the parameters; friction and rotors in NumPy."""
    n, data = model.nv, model.createData()
    inputs = _motion(n) | {"x": np.zeros(13 * n), "tau_measured": np.zeros(n)}
    q, v, a, x, tau_measured = inputs.values()
    phi, rotor, coulomb, viscous = np.split(x, [10 * n, 11 * n, 12 * n])
    results = {"tau": np.zeros(n), "gradient": np.zeros(13 * n)}

    def run() -> None:
        Y = pinocchio.computeJointTorqueRegressor(model, data, q, v, a)
        sign = np.tanh(v / V_REST)
        tau = Y @ phi + rotor * a + coulomb * sign + viscous * v
        error = tau - tau_measured
        results["tau"] = tau
        results["gradient"] = np.concatenate([error @ Y, error * a, error * sign, error * v])

    return Call(partial(copy_into, inputs), run, lambda: results, (model, data))


def _in_parallel(pinocchio: Any, model: Any, task: Task, batch: BatchShape) -> Call:
    only(task, "rnea")
    if batch.dtype != "float64":
        raise Missing("computes in double precision")
    if not getattr(pinocchio, "WITH_OPENMP", False):
        raise Missing("this build has no OpenMP, so no rneaInParallel")
    pool = pinocchio.ModelPool(model, 1)
    inputs = {name: np.zeros((model.nv, batch.size), order="F") for name in ("q", "v", "a")}
    tau = np.zeros((model.nv, batch.size), order="F")
    run: Callable[[], object] = partial(pinocchio.rneaInParallel, 1, pool, inputs["q"], inputs["v"], inputs["a"], tau)

    def load(state: State) -> None:
        copy_into(inputs, state)

    return Call(load, run, lambda: {"tau": tau}, (model, pool))


def _motion(n: int) -> dict[str, np.ndarray]:
    return {name: np.zeros(n) for name in ("q", "v", "a")}

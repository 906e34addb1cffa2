"""Tasks of a run and their states, drawn from one seed."""

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.control.tick import SLOPE_MAX, tick_function
from exograv.dynamics.closure import PIVOT_MIN
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.model.assembly import Assembly
from exograv.model.loops import LoopSolver
from exograv.model.tree import Tree
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess

from . import machines, programs
from .interface import State, Task

SEED = 0
STATES = 64
"""Number of different states; larger batches repeat them."""

TICK_S = 1e-3
TICK_RESULTS = ("tau_desired", "tau_feedforward", "tau_arm")
CLOSING_STEPS = 8
FIT_SD = np.array([0.012, 0.012, 0.012, 0.01, 0.005, 0.1, 0.1, 0.1, 0.1, 0.006, 0.006, *[0.001] * 12])
"""Spread of the arm's fit in the machine, in the order of `model.loops.FIT`: misaligned by about 2 cm, the elbow
oblique by 6°, the path of the shoulder turned by 30° about two axes, and its further shapes of a millimetre."""

Generator = np.random.Generator


@cache
def machine_and_assembly(n: int) -> tuple[CalibratedMachine, Assembly]:
    """Return machine and assembly of 4 or 7 joints."""
    assembly = machines.machine_of_4() if n == 4 else machines.machine_of_7()
    return nominal_machine(assembly.description, assembly.exo.phi), assembly


def tree_task(tree: Tree, name: str, quantity: str) -> Task:
    """Return the task of a bare tree: torque, its regressor or its derivatives."""
    make = {
        "rnea": programs.rnea_function,
        "regressor": programs.regressor_function,
        "rnea_derivatives": programs.derivatives_function,
    }
    n, function = len(tree.joints), make[quantity](tree)
    compared = tuple(function.name_out(i) for i in range(function.n_out()))
    return Task(name, quantity, function, tree, _draw(lambda g: _motion(g, n)), (), compared)  # pyright: ignore[reportArgumentType] - a name of the table above


def torque_gradient_task(n: int) -> Task:
    """Return the task of the torque gradient, with 13 parameters per joint."""
    machine, assembly = machine_and_assembly(n)
    friction = machine.friction
    known = np.concatenate([assembly.exo.phi.ravel(), machine.rotor_inertia, friction.coulomb, friction.viscous])
    x = known * np.random.default_rng(SEED).normal(1.0, 0.1, len(known))

    def state(generator: Generator) -> State:
        return {**_motion(generator, n), "x": x, "tau_measured": generator.normal(0.0, 10.0, n)}

    function = programs.torque_gradient_function(assembly.exo, friction)
    states = _draw(state)
    return Task(f"torque_gradient_{n}", "torque_gradient", function, assembly.exo, states, ("x",), ("tau", "gradient"))


def aligned_tick_task(n: int) -> Task:
    """Return the task of the aligned tick, in which nothing is solved."""
    machine, assembly = machine_and_assembly(n)
    tick = programs.AlignedTick(assembly, machines.aligned_arm(n), machine)
    x, function = tick.x, programs.aligned_tick_function(tick)
    states = _draw(lambda generator: {**_moment(generator, assembly), "x": x})
    return Task(
        f"tick_aligned_{n}",
        "tick_aligned",
        function,
        assembly.exo,
        states,
        ("x", "mode"),
        (*TICK_RESULTS, "spring"),
        tick,
    )


def general_tick_task(n: int) -> Task:
    """Return the task of `control.tick` itself: soft cuffs, shoulder centres apart."""
    machine, assembly = machine_and_assembly(n)
    function = tick_function(assembly, machine)
    x = table_guess(assembly, machine)
    fit = FIT_SD * np.random.default_rng(SEED).choice([-1.0, 1.0], len(FIT_SD))
    x[ParameterLayout.of(assembly).fit] = fit
    closing = _Closing(kernel.compile(function), LoopSolver(assembly), fit)
    # The hands are empty, the cuffs hold the arm, and the machine leads nothing; the same program can carry a weight.
    one, payload = np.ones(1), np.zeros(ParameterLayout.of(assembly).phi.stop)
    constants = {"x": x, "payload": payload, "held_before": one, "led": one}
    states = _draw(lambda generator: closing.closed({**_moment(generator, assembly), **constants}, generator))
    compared = (*TICK_RESULTS, "z", "G", "pivot")
    shared = ("x", "mode", "payload", "led")
    return Task(f"tick_general_{n}", "tick_general", function, assembly.exo, states, shared, compared)


class _Closing:
    """Generator that gives each state the closed posture of the tick before, as in the loop."""

    def __init__(self, tick: kernel.Kernel, solver: LoopSolver, fit: Float[np.ndarray, " fit"]):
        self._tick, self._solver, self._fit = tick, solver, fit

    def closed(self, state: dict[str, np.ndarray], generator: Generator) -> State:
        """Return the state one tick after a closed one; draw another posture if Newton's steps found none."""
        inputs, outputs = self._tick.inputs, self._tick.outputs
        for name, value in state.items():
            inputs[name][...] = value
        inputs["q"][...] = inputs["q_before"][...] = state["q"] - TICK_S * state["v"]
        inputs["z_before"][...], inputs["G_before"][...] = self._solver.solve(inputs["q"], fit=self._fit)[0], 0.0
        for _ in range(CLOSING_STEPS):
            self._tick()
            inputs["z_before"][...] = outputs["z"]
        if not (np.abs(outputs["slope"]).max() < SLOPE_MAX and outputs["pivot"][0] > PIVOT_MIN):
            state["q"] = state["q"] + generator.normal(0.0, 0.05, len(state["q"]))
            return self.closed(state, generator)
        before = {"q_before": inputs["q_before"], "z_before": outputs["z"], "G_before": outputs["G"]}
        return state | {name: value.copy() for name, value in before.items()}


def _motion(generator: Generator, n: int) -> dict[str, np.ndarray]:
    q, v, a = generator.uniform(-2.0, 2.0, (3, n)) * np.array([[1.0], [2.0], [4.0]])
    return {"q": q, "v": v, "a": a}


def _moment(generator: Generator, assembly: Assembly) -> dict[str, np.ndarray]:
    """Draw a moment in the task workspace, with the machine driven."""
    lower, upper = assembly.description.workspace
    q, n = generator.uniform(lower, upper), assembly.n
    v, a = generator.normal(0.0, 0.6, n), generator.normal(0.0, 2.0, n)
    return {
        "q": q,
        "v": v,
        "q_reference": q + generator.normal(0.0, 0.02, n),
        "v_reference": v + generator.normal(0.0, 0.05, n),
        "a_reference": a,
        "mode": np.array([1.0, 0.165, 1.0]),
        "q_before": q - TICK_S * v,
        "spring_before": generator.normal(0.0, 0.5, n),
    }


def _draw(state: Callable[[Generator], State]) -> tuple[State, ...]:
    generator = np.random.default_rng(SEED)
    return tuple(state(generator) for _ in range(STATES))


def stacked(task: Task, size: int, first: int) -> State:
    """Return `size` states side by side, starting with state `first`."""
    chosen: Sequence[State] = [task.states[(first + i) % len(task.states)] for i in range(min(size, len(task.states)))]
    columns = np.arange(size) % len(chosen)
    return {
        name: chosen[0][name]
        if name in task.shared
        else np.stack([state[name] for state in chosen], axis=-1)[..., columns]
        for name in chosen[0]
    }

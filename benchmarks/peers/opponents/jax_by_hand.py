"""JAX in its usual style: the recursion on jax.numpy's small matrices, derivatives by JAX."""

from collections.abc import Callable
from typing import Any

from exograv.identification.calibration.empty_machine import V_REST
from peers.tasks.interface import BatchShape, Call, Missing, Task

from .jax_engine import jax_module, jax_version, jitted
from .jax_recursion import Recursion
from .jax_tick import aligned_tick


class JaxByHand:
    """`jax.jit`, and `jax.vmap` over the first axis."""

    name = "JAX"

    def version(self) -> str:
        """Return the version of JAX."""
        return jax_version()

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build any task but the general tick: written by hand, that would be another model."""
        return jitted(_function(jax_module(), task), task.compared, task, batch, axis=0)


class JaxAhead:
    """The same, compiled ahead of the first call: `jax.jit(…).lower(…).compile()`, without a look-up of the trace."""

    name = "JAX, compiled ahead"

    def version(self) -> str:
        """Return the version of JAX."""
        return jax_version()

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build any task but the general tick."""
        return jitted(_function(jax_module(), task), task.compared, task, batch, axis=0, is_ahead=True)


def _function(jax: Any, task: Task) -> Callable[..., list[Any]]:
    if task.quantity == "tick_general":
        raise Missing("not written by hand: thousands of lines of another model; see our program in JAX")
    if task.aligned is not None:
        return aligned_tick(jax.numpy, task.aligned)
    rnea, phi, n = Recursion(jax.numpy, task.tree), task.tree.phi, len(task.tree.joints)
    if task.quantity == "rnea":
        return lambda q, v, a: [rnea(q, v, a, phi)]
    if task.quantity == "regressor":
        known = jax.numpy.asarray(phi.ravel())
        return lambda q, v, a: [jax.jacfwd(lambda p: rnea(q, v, a, p.reshape(n, 10)))(known.astype(q.dtype))]
    if task.quantity == "rnea_derivatives":
        return lambda q, v, a: list(jax.jacfwd(lambda q, v, a: rnea(q, v, a, phi), argnums=(0, 1, 2))(q, v, a))
    return _torque_gradient(jax, rnea, n)


def _torque_gradient(jax: Any, rnea: Recursion, n: int) -> Callable[..., list[Any]]:
    def loss(x: Any, q: Any, v: Any, a: Any, tau_measured: Any) -> tuple[Any, Any]:
        phi, (rotor, coulomb, viscous) = x[: 10 * n].reshape(n, 10), x[10 * n :].reshape(3, n)
        tau = rnea(q, v, a, phi) + rotor * a + coulomb * jax.numpy.tanh(v / V_REST) + viscous * v
        return 0.5 * jax.numpy.sum((tau - tau_measured) ** 2), tau

    def evaluate(q: Any, v: Any, a: Any, x: Any, tau_measured: Any) -> list[Any]:
        (_, tau), gradient = jax.value_and_grad(loss, has_aux=True)(x, q, v, a, tau_measured)
        return [tau, gradient]

    return evaluate

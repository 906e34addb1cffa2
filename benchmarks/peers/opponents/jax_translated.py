"""JAX from our own program: each instruction of the CasADi function as one operation of jax.numpy."""

from collections.abc import Callable
from typing import Any

import casadi as ca

from exograv.kernel.program import Program, straight_line
from peers.tasks.interface import BatchShape, Call, Missing, Task

from .jax_engine import jax_module, jax_version, jitted


class JaxTranslated:
    """`jax.jit`, and `jax.vmap` with the states of each number side by side: XLA has nothing left to simplify."""

    name = "JAX, our program"

    def version(self) -> str:
        """Return the version of JAX."""
        return jax_version()

    def build(self, task: Task, batch: BatchShape | None) -> Call:
        """Build any task: every task can be translated."""
        jax, program = jax_module(), straight_line(task.function)
        return jitted(translated(jax.numpy, program), list(program.results), task, batch, axis=-1)


def translated(jnp: Any, program: Program) -> Callable[..., list[Any]]:
    """Return the program as a function of arrays, with a list of arrays as its result.

    Raises:
        Missing: JAX has no such operation.
    """
    table = _operations(jnp)
    unknown = {instruction.operation for instruction in program.instructions} - set(table) - _PLACED
    if unknown:
        raise Missing(f"no translation of CasADi's operations {', '.join(map(str, sorted(unknown)))}")
    constants = [float(value) for value in program.constants]

    def evaluate(*arguments: Any) -> list[Any]:
        elements = [jnp.ravel(argument.T) for argument in arguments]  # column by column
        results: list[list[Any]] = [[None] * (rows * columns) for rows, columns in program.results.values()]
        values: list[Any] = []
        for operation, operands, (memory, element) in program.instructions:
            if operation == ca.OP_CONST:
                values.append(constants[element])
            elif operation == ca.OP_INPUT:
                values.append(elements[memory][element])
            elif operation == ca.OP_OUTPUT:
                results[memory][element] = values[operands[0]]
                values.append(None)
            else:
                values.append(table[operation](*(values[operand] for operand in operands)))
        dtype = arguments[0].dtype
        return [
            _shaped(jnp, [jnp.asarray(value, dtype) for value in result], shape)
            for result, shape in zip(results, program.results.values(), strict=True)
        ]

    return evaluate


def _shaped(jnp: Any, values: list[Any], shape: tuple[int, int]) -> Any:
    rows, columns = shape
    stacked = jnp.stack(values)
    return stacked if columns == 1 else stacked.reshape(columns, rows).T


_PLACED = {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT}


def _operations(jnp: Any) -> dict[int, Callable[..., Any]]:
    def truth(condition: Any) -> Any:
        return jnp.where(condition, 1.0, 0.0)

    return {
        ca.OP_ADD: lambda a, b: a + b,
        ca.OP_SUB: lambda a, b: a - b,
        ca.OP_MUL: lambda a, b: a * b,
        ca.OP_DIV: lambda a, b: a / b,
        ca.OP_NEG: lambda a: -a,
        ca.OP_SQ: lambda a: a * a,
        ca.OP_TWICE: lambda a: a + a,
        ca.OP_INV: lambda a: 1.0 / a,
        ca.OP_SQRT: jnp.sqrt,
        ca.OP_SIN: jnp.sin,
        ca.OP_COS: jnp.cos,
        ca.OP_TANH: jnp.tanh,
        ca.OP_EXP: jnp.exp,
        ca.OP_LOG: jnp.log,
        ca.OP_FABS: jnp.abs,
        ca.OP_SIGN: jnp.sign,
        ca.OP_ATAN2: jnp.arctan2,
        ca.OP_COPYSIGN: jnp.copysign,
        ca.OP_POW: jnp.power,
        ca.OP_CONSTPOW: jnp.power,
        ca.OP_FMIN: jnp.fmin,
        ca.OP_FMAX: jnp.fmax,
        ca.OP_LT: lambda a, b: truth(a < b),
        ca.OP_LE: lambda a, b: truth(a <= b),
        ca.OP_EQ: lambda a, b: truth(a == b),
        ca.OP_NE: lambda a, b: truth(a != b),
        ca.OP_NOT: lambda a: truth(a == 0),
        ca.OP_AND: lambda a, b: truth((a != 0) & (b != 0)),
        ca.OP_OR: lambda a, b: truth((a != 0) | (b != 0)),
        ca.OP_IF_ELSE_ZERO: lambda a, b: jnp.where(a != 0, b, 0.0),
    }

"""Functions as a straight sequence of instructions, each value written once; input of both engines."""

from array import array
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import NamedTuple

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.errors import KernelError

from .operations import refuse_unknown

Value = int
"""Index of the instruction that computes the value."""


class Instruction(NamedTuple):
    """Instruction of a program; the meaning of `place` depends on the operation."""

    operation: int
    """Operation code of CasADi."""

    operands: tuple[Value, ...]
    place: tuple[int, int] = (0, 0)
    """Place of the value in memory.

    For OP_INPUT and OP_OUTPUT: index of the argument or result, and of the element, column by column. For OP_CONST: 0,
    and index of the constant.
    """


@dataclass(frozen=True)
class Program:
    """Dense function without branches, and its instructions."""

    function: ca.Function
    """CasADi function, dense in all arguments and results, with common subexpressions shared."""

    @property
    def name(self) -> str:
        """Name that the caller gave the function."""
        return self.function.name()

    @cached_property
    def arguments(self) -> dict[str, tuple[int, int]]:
        """Rows and columns of each argument, by name."""
        return {self.function.name_in(i): self.function.size_in(i) for i in range(self.function.n_in())}

    @cached_property
    def results(self) -> dict[str, tuple[int, int]]:
        """Rows and columns of each result, by name."""
        return {self.function.name_out(i): self.function.size_out(i) for i in range(self.function.n_out())}

    @property
    def instructions(self) -> list[Instruction]:
        """Instructions in order; each value has its own number, while CasADi's work vector reuses slots.

        Raises:
            KernelError: The function has an unknown operation, which the message names.
        """
        return self._content[0]

    @property
    def constants(self) -> Float[np.ndarray, " constant"]:
        """Constants of the program, kept apart from it: another arm in the same machine is the same program."""
        return self._content[1]

    @cached_property
    def fingerprint(self) -> str:
        """Digest of names, shapes and instructions, without the constants."""
        numbers = array("q")
        for operation, operands, place in self.instructions:
            numbers.extend((operation, len(operands), *operands, *place))
        digest = blake2b(numbers.tobytes(), digest_size=16)
        digest.update(repr((self.arguments, self.results)).encode())
        return digest.hexdigest()

    @cached_property
    def _content(self) -> tuple[list[Instruction], Float[np.ndarray, " constant"]]:
        function, written = self.function, {}
        instructions: list[Instruction] = []
        constants: list[float] = []
        for i in range(function.n_instructions()):
            operation = function.instruction_id(i)
            inputs, outputs = function.instruction_input(i), function.instruction_output(i)
            if operation in (ca.OP_ASSIGN, ca.OP_LIFT):
                written[outputs[0]] = written[inputs[0]]
                continue
            if operation == ca.OP_CONST:
                instruction = Instruction(operation, (), (0, len(constants)))
                constants.append(function.instruction_constant(i))
            elif operation == ca.OP_INPUT:
                instruction = Instruction(operation, (), (inputs[0], inputs[1]))
            elif operation == ca.OP_OUTPUT:
                instruction = Instruction(operation, (written[inputs[0]],), (outputs[0], outputs[1]))
            else:
                refuse_unknown(operation)
                instruction = Instruction(operation, tuple(written[slot] for slot in inputs))
            if operation != ca.OP_OUTPUT:
                written[outputs[0]] = len(instructions)
            instructions.append(instruction)
        return instructions, np.array(constants)


def straight_line(function: ca.Function) -> Program:
    """Return the program of a function.

    Raises:
        KernelError: The function cannot be written as one sequence of scalar operations.
    """
    # Results are made dense: a structural zero would shift every entry after it.
    arguments = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    name_in = [function.name_in(i) for i in range(function.n_in())]
    name_out = [function.name_out(i) for i in range(function.n_out())]
    try:
        results = [ca.densify(result) for result in function.call(arguments)]
        return Program(ca.Function(function.name(), arguments, results, name_in, name_out, {"cse": True}))
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise KernelError(
            f"{function.name()} cannot be written as one sequence of scalar operations: {reason} "
            "Write it on SX expressions, without calls to solvers or external code."
        ) from error

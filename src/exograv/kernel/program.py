"""A function as one straight line of instructions, each value written once: what every engine of the room runs."""

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
"""Number of the instruction that wrote it."""


class Instruction(NamedTuple):
    """One operation; which fields mean something depends on it."""

    operation: int
    """CasADi's code."""

    operands: tuple[Value, ...]
    place: tuple[int, int] = (0, 0)
    """Of OP_INPUT and OP_OUTPUT: which argument or result, and which element, column by column. Of OP_CONST: 0, and
    which of the constants."""


@dataclass(frozen=True)
class Program:
    """A dense function without branches, and its instructions."""

    function: ca.Function
    """Dense in all arguments and results, common parts shared."""

    @property
    def name(self) -> str:
        """As the caller named the function."""
        return self.function.name()

    @cached_property
    def arguments(self) -> dict[str, tuple[int, int]]:
        """Rows and columns by name."""
        return {self.function.name_in(i): self.function.size_in(i) for i in range(self.function.n_in())}

    @cached_property
    def results(self) -> dict[str, tuple[int, int]]:
        """Rows and columns by name."""
        return {self.function.name_out(i): self.function.size_out(i) for i in range(self.function.n_out())}

    @property
    def instructions(self) -> list[Instruction]:
        """In order. CasADi's work vector reuses its slots; here every value has its own number.

        Raises:
            KernelError: An operation is not known; it is named.
        """
        return self._content[0]

    @property
    def constants(self) -> Float[np.ndarray, " constant"]:
        """Numbers in the program, apart from it: another arm in the same machine is the same program."""
        return self._content[1]

    @cached_property
    def fingerprint(self) -> str:
        """Of names, shapes and instructions; not of the constants."""
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
    """The program of a function.

    Raises:
        KernelError: It cannot be written as one line of scalar operations.
    """
    # Results are made dense: a structural zero would otherwise shift every entry after it.
    arguments = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    name_in = [function.name_in(i) for i in range(function.n_in())]
    name_out = [function.name_out(i) for i in range(function.n_out())]
    try:
        results = [ca.densify(result) for result in function.call(arguments)]
        return Program(ca.Function(function.name(), arguments, results, name_in, name_out, {"cse": True}))
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise KernelError(
            f"{function.name()} cannot be written as one line of scalar operations: {reason} "
            "Write it on SX expressions, without calls to solvers or external code."
        ) from error

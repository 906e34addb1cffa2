"""Functions as a straight sequence of instructions, each value written once; input of both engines."""

from array import array
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import NamedTuple

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.errors import KernelError

from .operations import refuse_unknown
from .recipe import AnyFunction, Outline, Recipe, Shapes

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
    """Dense function without branches, and its instructions.

    A program with a stored outline builds its function only if a caller asks for it.
    """

    build: Callable[[], ca.Function]
    """Function that builds the CasADi function."""

    stored: Outline | None = None
    """Outline from the disk cache."""

    recipe: Recipe | None = None
    """Recipe under which the outline is stored; None for a function that the caller has built."""

    @cached_property
    def function(self) -> ca.Function:
        """CasADi function, dense in all arguments and results, with common subexpressions shared."""
        return self.build()

    @cached_property
    def outline(self) -> Outline:
        """Facts that the compiled code needs."""
        return self.stored or self._outlined()

    def outlined(self) -> "Program":
        """Return the program with its outline only: a compiled kernel needs no function and no instructions.

        They take tens of megabytes.
        """
        return Program(_forgotten, self.outline)

    def keep(self) -> None:
        """Store the outline of a recipe for later processes, if it is not stored yet."""
        if self.recipe is not None and self.stored is None:
            self.recipe.store(self.outline)

    @property
    def name(self) -> str:
        """Name that the caller gave the function."""
        return self.stored.name if self.stored else self.function.name()

    @cached_property
    def arguments(self) -> Shapes:
        """Rows and columns of each argument, by name."""
        if self.stored:
            return self.stored.arguments
        return {self.function.name_in(i): self.function.size_in(i) for i in range(self.function.n_in())}

    @cached_property
    def results(self) -> Shapes:
        """Rows and columns of each result, by name."""
        if self.stored:
            return self.stored.results
        return {self.function.name_out(i): self.function.size_out(i) for i in range(self.function.n_out())}

    @property
    def constants(self) -> Float[np.ndarray, " constant"]:
        """Constants of the program, kept apart from it: another arm in the same machine is the same program."""
        return self.outline.constants

    @property
    def fingerprint(self) -> str:
        """Digest of names, shapes and instructions, without the constants."""
        return self.outline.fingerprint

    @property
    def n_instructions(self) -> int:
        """Length of the program [-]."""
        return self.outline.n_instructions

    @property
    def instructions(self) -> list[Instruction]:
        """Instructions in order; each value has its own number, while CasADi's work vector reuses slots.

        Raises:
            KernelError: The function has an unknown operation, which the message names.
        """
        return self._content[0]

    def _outlined(self) -> Outline:
        instructions, constants = self._content
        numbers = array("q")
        for operation, operands, place in instructions:
            numbers.extend((operation, len(operands), *operands, *place))
        digest = blake2b(numbers.tobytes(), digest_size=16)
        digest.update(repr((self.arguments, self.results)).encode())
        facts = constants, digest.hexdigest(), len(instructions)
        return Outline(self.name, self.arguments, self.results, *facts)

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


def straight_line(function: AnyFunction) -> Program:
    """Return the program of a function, or of a recipe, whose outline may be on disk.

    Raises:
        KernelError: The function cannot be written as one sequence of scalar operations.
    """
    if isinstance(function, Recipe):
        return Program(lambda: _dense(function()), function.outline(), function)
    dense = _dense(function)
    return Program(lambda: dense)


def _forgotten() -> ca.Function:
    raise KernelError("The function of a compiled kernel is not kept. Compile the function again.")


def _dense(function: ca.Function) -> ca.Function:
    # Results are made dense: a structural zero would shift every entry after it.
    arguments = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    name_in = [function.name_in(i) for i in range(function.n_in())]
    name_out = [function.name_out(i) for i in range(function.n_out())]
    try:
        results = [ca.densify(result) for result in function.call(arguments)]
        return ca.Function(function.name(), arguments, results, name_in, name_out, {"cse": True})
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise KernelError(
            f"{function.name()} cannot be written as one sequence of scalar operations: {reason} "
            "Write it on SX expressions, without calls to solvers or external code."
        ) from error

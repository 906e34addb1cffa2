"""Program as LLVM functions of straight code, each short enough for the compiler; longer-lived values lie in memory."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import casadi as ca

from exograv.errors import KernelError

from .operations import PLACED, TRIGONOMETRIC, Operations
from .program import Instruction, Program, Value
from .text import float_type
from .trigonometry import sincos_name

PIECE, LONG_PROGRAM, PIECE_OF_LONG = 4000, 20_000, 500
"""Instructions of one function, in a short program, limit of a long program, and in a long one.

LLVM's time grows faster than the length of a block. 88 000 instructions took it 17 s in one block and 4.6 s in blocks
of 500, for 7 % more time per call. Short programs are called most and get the long blocks.
"""


WORK_BYTES_MAX = 1_000_000
"""Largest memory for values that outlive their function; a thread's stack is usually 8 MB."""


@dataclass(frozen=True)
class MemoryLayout:
    """Layout of arguments and results in memory."""

    lanes: int = 1
    """Number of states that one instruction processes (SIMD lanes). With 1, the elements of a state are contiguous."""

    element: str = "double"

    shared: frozenset[int] = frozenset()
    """Arguments of a batch that are the same for every state."""

    carried: tuple[tuple[int, int, int], ...] = ()
    """Copies of memory after a call: source, target and number of elements; for a single state only."""


@dataclass
class _Piece:
    """LLVM function under construction."""

    index: int
    lines: list[str] = field(default_factory=list)
    names: dict[Value, str] = field(default_factory=dict)
    pointers: dict[int, str] = field(default_factory=dict)


class Emission:
    """Functions `@piece.0`, `@piece.1` …, to be called in order, and the declarations they need."""

    def __init__(self, program: Program, layout: MemoryLayout):
        self._program, self._layout = program, layout
        self._operations = Operations(layout.lanes, layout.element)
        self._T, self._n_arguments = self._operations.T, len(program.arguments)
        self._constants = self._n_arguments + len(program.results)
        self._instructions = program.instructions
        self._birth = _births(self._instructions)
        self._slots, self._n_slots = _slots(self._instructions, self._birth)
        self.has_trigonometry = False
        """True if the program has a sine or cosine."""

    def pieces(self) -> Iterator[str]:
        """Yield the definition of each function.

        Raises:
            KernelError: The program has an unknown operation.
        """
        for index, start in enumerate(range(0, max(len(self._instructions), 1), self._birth.piece_length)):
            piece = _Piece(index)
            for value in range(start, min(start + self._birth.piece_length, len(self._instructions))):
                self._write(piece, value, self._instructions[value])
            body = "\n".join("  " + line for line in piece.lines)
            parameters = "ptr %args, ptr %work, i64 %at, i64 %row"
            yield f"define internal void @piece.{index}({parameters}) #0 {{\n{body}\n  ret void\n}}\n"

    @property
    def work(self) -> str:
        """Line that reserves the memory of all functions on the stack of the caller.

        Raises:
            KernelError: The memory exceeds what a thread's stack can hold safely.
        """
        element_bytes = 8 if self._layout.element == "double" else 4
        needed = self._n_slots * self._layout.lanes * element_bytes
        if needed > WORK_BYTES_MAX:
            raise KernelError(
                f"{self._program.name} keeps {self._n_slots} values at once, {needed} bytes on {self._layout.lanes} "
                f"lanes; {WORK_BYTES_MAX} are allowed. Use fewer lanes, or split the function."
            )
        return f"%work = alloca {self._T}, i64 {max(self._n_slots, 1)}, align 64"

    @property
    def declarations(self) -> set[str]:
        """Declarations of the functions that the pieces call."""
        return self._operations.declared

    def _write(self, piece: _Piece, value: Value, instruction: Instruction) -> None:
        operation = instruction.operation
        if operation in (ca.OP_CONST, ca.OP_INPUT):
            return  # loaded where it is used: a value in memory need not occupy a register
        operands = [self._operand(piece, operand) for operand in instruction.operands]
        if operation == ca.OP_OUTPUT:
            address = self._address(piece, f"%o{value}", self._n_arguments + instruction.place[0], instruction.place[1])
            piece.lines.append(f"store {self._T} {operands[0]}, ptr {address}, align {self._alignment}")
        elif operation in TRIGONOMETRIC:
            self._write_pair(piece, value, operands[0])
        else:
            piece.lines += self._operations.lines(operation, f"%v{value}", operands)
            self._born(piece, value, f"%v{value}")

    def _write_pair(self, piece: _Piece, value: Value, operand: str) -> None:
        """Write sine and cosine of an operand together, at the first of the two."""
        if self._birth.pairs[value][0] != value:
            return
        self.has_trigonometry = True
        wide, name = float_type(self._layout.lanes), f"%v{value}"
        lines, (angle,) = self._operations.widened(name, [operand])
        piece.lines += lines
        piece.lines.append(f"{name}.b = call {{ {wide}, {wide} }} {sincos_name(self._layout.lanes)}({wide} {angle})")
        for i, operation in enumerate(TRIGONOMETRIC):
            piece.lines.append(f"{name}.r{i} = extractvalue {{ {wide}, {wide} }} {name}.b, {i}")
            lines, result = self._operations.narrowed(f"{name}.f{i}", f"{name}.r{i}")
            piece.lines += lines
            for twin in self._birth.pairs[value]:
                if self._instructions[twin].operation == operation:
                    self._born(piece, twin, result)

    def _born(self, piece: _Piece, value: Value, name: str) -> None:
        piece.names[value] = name
        if value in self._slots:
            slot = f"getelementptr {self._T}, ptr %work, i64 {self._slots[value]}"
            piece.lines += [f"%k{value} = {slot}", f"store {self._T} {name}, ptr %k{value}"]

    def _operand(self, piece: _Piece, value: Value) -> str:
        if value in piece.names:
            return piece.names[value]
        instruction, name = self._instructions[value], f"%u{value}"
        argument, element = instruction.place
        if instruction.operation == ca.OP_CONST:
            self._load(piece, name, self._constants, element, is_shared=True)
        elif instruction.operation == ca.OP_INPUT:
            self._load(piece, name, argument, element, is_shared=argument in self._layout.shared)
        else:
            slot = f"getelementptr {self._T}, ptr %work, i64 {self._slots[value]}"
            piece.lines += [f"{name}.k = {slot}", f"{name} = load {self._T}, ptr {name}.k"]
        piece.names[value] = name
        return name

    def _load(self, piece: _Piece, name: str, memory: int, element: int, *, is_shared: bool) -> None:
        layout, T = self._layout, self._T
        if layout.lanes == 1 or not is_shared:
            address = self._address(piece, f"{name}.a", memory, element)
            piece.lines.append(f"{name} = load {T}, ptr {address}, align {self._alignment}, !invariant.load !0")
            return
        base = self._pointer(piece, memory)
        piece.lines += [
            f"{name}.a = getelementptr {layout.element}, ptr {base}, i64 {element}",
            f"{name}.1 = load {layout.element}, ptr {name}.a, align {self._alignment}, !invariant.load !0",
            f"{name}.i = insertelement {T} poison, {layout.element} {name}.1, i32 0",
            f"{name} = shufflevector {T} {name}.i, {T} poison, <{layout.lanes} x i32> zeroinitializer",
        ]

    def _address(self, piece: _Piece, name: str, memory: int, element: int) -> str:
        """Return the name of an element's address; in a batch, of its row at the current states."""
        base, scalar = self._pointer(piece, memory), self._layout.element
        if self._layout.lanes == 1:
            piece.lines.append(f"{name} = getelementptr {scalar}, ptr {base}, i64 {element}")
            return name
        piece.lines += [
            f"{name}.r = mul i64 %row, {element}",
            f"{name}.e = add i64 {name}.r, %at",
            f"{name} = getelementptr {scalar}, ptr {base}, i64 {name}.e",
        ]
        return name

    def _pointer(self, piece: _Piece, memory: int) -> str:
        if memory not in piece.pointers:
            name = f"%m{memory}"
            piece.lines += [
                f"{name}.a = getelementptr ptr, ptr %args, i64 {memory}",
                f"{name} = load ptr, ptr {name}.a, !invariant.load !0",
            ]
            piece.pointers[memory] = name
        return piece.pointers[memory]

    @property
    def _alignment(self) -> int:
        return 8 if self._layout.element == "double" else 4


@dataclass(frozen=True)
class _Births:
    """Pieces in which values are computed."""

    pairs: Mapping[Value, tuple[Value, ...]]
    """All sines and cosines of the same operand; they are computed with the first of them."""

    piece_length: int

    def piece(self, value: Value) -> int:
        return self.pairs.get(value, (value,))[0] // self.piece_length


def _births(instructions: list[Instruction]) -> _Births:
    by_operand: dict[Value, list[Value]] = {}
    for value, instruction in enumerate(instructions):
        if instruction.operation in TRIGONOMETRIC:
            by_operand.setdefault(instruction.operands[0], []).append(value)
    pairs = {value: tuple(values) for values in by_operand.values() for value in values}
    return _Births(pairs, PIECE if len(instructions) < LONG_PROGRAM else PIECE_OF_LONG)


def _slots(instructions: list[Instruction], birth: _Births) -> tuple[dict[Value, int], int]:
    """Return memory slots of values that later pieces need, and their number; a slot is reused after its last piece."""
    last: dict[Value, int] = {}
    for value, instruction in enumerate(instructions):
        for operand in instruction.operands:
            if instructions[operand].operation not in PLACED:
                # The second of a pair is written where the first is, and its operand is read there.
                last[operand] = max(last.get(operand, 0), value // birth.piece_length)
    expiring: dict[int, list[int]] = {}
    free, slots, n_slots, piece = [], {}, 0, 0
    for value in sorted((v for v, end in last.items() if end > birth.piece(v)), key=birth.piece):
        while piece < birth.piece(value):
            free += expiring.pop(piece, [])
            piece += 1
        if not free:
            free.append(n_slots)
            n_slots += 1
        slots[value] = free.pop()
        expiring.setdefault(last[value], []).append(slots[value])
    return slots, n_slots

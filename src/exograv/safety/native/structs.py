"""C declarations of records that Python and C share: the ctypes class is the only definition.

Each room that owns C code writes its header from its own classes; a test fails where header and classes differ.
"""

import ctypes
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

WARNING = "/* Made from the classes in record.py; do not edit. docs/explanation/realtime.md says how. */"

NUMBERS: Mapping[Any, str] = {
    ctypes.c_double: "double",
    ctypes.c_int64: "int64_t",
    ctypes.c_uint64: "uint64_t",
    ctypes.c_uint32: "uint32_t",
    ctypes.c_uint8: "uint8_t",
    ctypes.c_void_p: "void *",
}


def check_sum(text: str) -> int:
    """Return the CRC-32 of a text, by which a library tells from which source it was made."""
    return zlib.crc32(text.encode())


def declaration(record: type[ctypes.Structure]) -> str:
    """Return the C struct with the fields of a ctypes class, which must be numbers, arrays, or structs."""
    lines = [f"    {_field(name, kind)};" for name, kind, *_ in record._fields_]
    return "\n".join([f"typedef struct {c_name(record)} {{", *lines, f"}} {c_name(record)};", ""])


def header(
    records: Sequence[type[ctypes.Structure]], constants: Mapping[str, float | int], includes: Sequence[str] = ()
) -> str:
    """Return a C header with constants and structs, in this order.

    Its constant `LAYOUT_OF_…`, with the name of the last record, is the check sum of all that follows.
    """
    defines = [f"#define {name} {value!r}" for name, value in constants.items()]
    included = [f'#include "{name}"' for name in includes]
    body = "\n".join([*included, "", *defines, "", *map(declaration, records)])
    layout = f"#define LAYOUT_OF_{c_name(records[-1]).upper()} {check_sum(body)}"
    return "\n".join([WARNING, "#pragma once", "#include <stdint.h>", layout, body])


def layout_in(text: str) -> int:
    """Return the check sum that a C header states.

    Raises:
        ValueError: It states none.
    """
    stated = next((line for line in text.splitlines() if line.startswith("#define LAYOUT_OF_")), "")
    return int(stated.rpartition(" ")[2])


def c_name(record: type[ctypes.Structure]) -> str:
    """Name of the struct in C: the name of the class in lower case, words joined by underscores."""
    parts = ["_" + letter.lower() if letter.isupper() else letter for letter in record.__name__]
    return "".join(parts).removeprefix("_")


def _field(name: str, kind: Any) -> str:
    sizes = ""
    while issubclass(kind, ctypes.Array):
        sizes, kind = f"{sizes}[{kind._length_}]", kind._type_
    text = c_name(kind) if issubclass(kind, ctypes.Structure) else NUMBERS[kind]
    return f"{text}{name}{sizes}" if text.endswith("*") else f"{text} {name}{sizes}"

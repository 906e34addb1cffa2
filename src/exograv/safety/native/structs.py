"""C declarations of records that Python and C share: the ctypes class is the only definition.

Each room that owns C code writes its header from its own classes; a test fails where header and classes differ.
"""

import ctypes
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


def declaration(record: type[ctypes.Structure]) -> str:
    """Return the C struct with the fields of a ctypes class, which must be numbers, arrays, or structs."""
    lines = [f"    {_field(name, kind)};" for name, kind, *_ in record._fields_]
    return "\n".join([f"typedef struct {c_name(record)} {{", *lines, f"}} {c_name(record)};", ""])


def header(
    records: Sequence[type[ctypes.Structure]], constants: Mapping[str, float | int], includes: Sequence[str] = ()
) -> str:
    """Return a C header with constants and structs, in this order."""
    defines = [f"#define {name} {value!r}" for name, value in constants.items()]
    included = [f'#include "{name}"' for name in includes]
    parts = [WARNING, "#pragma once", "#include <stdint.h>", *included, "", *defines, "", *map(declaration, records)]
    return "\n".join(parts)


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

"""The documentation, the C header and our own program have every field at the same byte."""

import importlib.util
import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.udp.layout import LAYOUTS, PARTS, DriveFlag, Flag, Type, is_newer, length, offsets, packed

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "reference" / "udp_protocol.md").read_text(encoding="utf-8")
PEER = ROOT / "examples" / "udp_peer"


@pytest.fixture(scope="module")
def tables() -> str:
    """Tables that `make docs` inserts into the page."""
    specification = importlib.util.spec_from_file_location("udp_tables", ROOT / "docs" / "udp_tables.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module.udp_tables()


@pytest.mark.parametrize("part", PARTS)
def test_the_tables_have_each_field_at_its_byte_in_the_order_of_the_packet(part: str, tables: str):
    fields, begin = PARTS[part]
    rows = [f"| {at} | `{name}` |" for name, at in offsets(fields, begin).items()]
    lines = [line[: line.index("` |") + 3] for line in tables.splitlines() if line.startswith("| ") and "` |" in line]
    assert any(lines[first : first + len(rows)] == rows for first in range(len(lines)))


def test_the_tables_have_each_type_with_its_length_and_every_bit_is_explained(tables: str):
    for kind in Type:
        assert f"| {kind.value} | {kind.name} | {length(kind, 4)} | {length(kind, 16)} | " in tables
    for bit in (*Flag, *DriveFlag, *DriveFault):
        assert f"| {bit.value} | {bit.name} | " in tables


def test_the_page_inserts_the_tables():
    assert "```{include} generated/udp_tables.inc\n```" in PAGE


@pytest.mark.parametrize("part", PARTS)
def test_no_field_needs_padding_in_a_c_struct(part: str):
    fields, begin = PARTS[part]
    for field, at in zip(fields, offsets(fields, begin).values(), strict=True):
        size = 1 if field.kind == "char" else packed((field,)).size
        assert at % size == 0
    assert packed(fields).size % 8 == 0


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    """Offsets in the compiled C header, by struct and member."""
    if shutil.which("gcc") is None:
        pytest.skip("no gcc")
    program = tmp_path_factory.mktemp("peer") / "peer"
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror"]
    subprocess.run(["gcc", *flags, str(PEER / "peer.c"), "-lm", "-o", str(program)], check=True)
    said = subprocess.run([program, "--layout"], capture_output=True, text=True, check=True).stdout
    return {" ".join(line.split()[:2]): int(line.split()[2]) for line in said.splitlines()}


def test_the_c_header_has_each_field_at_its_byte(compiled: dict[str, int]):
    expected = {f"{part} {name}": at for part in PARTS for name, at in offsets(*PARTS[part]).items()}
    for kind in (Type.NAMEPLATE, Type.STATE, Type.COMMAND):
        expected[f"{kind.name.lower()} joint"] = LAYOUTS[kind].joints_at
    for kind in (Type.HELLO, Type.STATE, Type.COMMAND, Type.BYE):
        expected[f"size {kind.name.lower()}"] = length(kind, 4)
    assert compiled == expected


def test_no_answer_is_longer_than_what_asks_for_it():
    for joints in range(17):
        assert length(Type.NAMEPLATE, joints) <= length(Type.HELLO, 0)
        assert length(Type.STATE, joints) <= length(Type.POLL, joints)
    assert max(length(kind, 16) for kind in Type) < 1472  # one Ethernet frame, never fragments


def test_after_the_last_sequence_comes_the_first():
    assert is_newer(0, 2**32 - 1)
    assert is_newer(5, 2**32 - 5)
    assert not is_newer(2**32 - 1, 0)
    assert not is_newer(7, 7)
    assert not is_newer(2**31, 0)


def test_the_magic_is_text_in_a_dump():
    assert struct.pack("<I", 0x56475845) == b"EXGV"

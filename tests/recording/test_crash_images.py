"""A file that was cut, altered or torn at any kind of place gives back its content before the damage, and no more."""

import struct
from collections import Counter
from collections.abc import Iterator

import numpy as np
import pytest

from exograv.recording import RecordingWriter
from exograv.recording.contents import FileEnding, examine
from exograv.recording.encoding import tick_dtype

JOINTS, CHUNKS, TICKS = ("flexion", "elbow"), 6, 8
HEAD = struct.Struct("<BQ")
OPCODES = {1: "header", 2: "footer", 3: "schema", 4: "channel", 6: "chunk", 7: "index", 8: "chunk index"}
OPCODES |= {11: "statistics", 15: "data end"}
SECTOR = 512
"""Block that a disk writes at once, and that a failing disk loses at once [bytes]."""

Told = tuple[bytes, list[tuple[str, bytes]], FileEnding]


def told(content: bytes) -> Told:
    """Return ticks, other messages, and the state of the file's end."""
    ticks, others = [], []
    found = examine(content, lambda topic, data: (ticks if topic == "/tick" else others).append((topic, data)))
    return b"".join(data for _, data in ticks), others, found.ending


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Content of a complete file of some chunks."""
    path, rng = tmp_path_factory.mktemp("images") / "a.mcap", np.random.default_rng(0)
    with RecordingWriter(path, JOINTS, {"seed": 3}) as recording:
        for k in range(CHUNKS):
            rows = np.zeros(TICKS, tick_dtype(len(JOINTS)))
            rows["sequence"] = np.arange(TICKS * k, TICKS * (k + 1))
            rows["q_measured"] = rng.normal(size=(TICKS, len(JOINTS)))
            recording.phase(float(k), str(k))
            recording.ticks(rows)
            recording.sync()
        recording.write("/event", 9.0, {"kind": "note", "text": "the end"})
    return path.read_bytes()


def places(content: bytes) -> list[str]:
    """Return the part of the file that each byte belongs to, by the layout of MCAP: by record, head and body apart."""
    names, at = ["magic"] * 8, 8
    while at < len(content) - 8:
        opcode, length = HEAD.unpack_from(content, at)
        name = OPCODES[opcode]
        names += [f"{name}, head"] * HEAD.size + [name] * length
        at += HEAD.size + length
    return names + ["last magic"] * 8


def whole_until(content: bytes) -> list[tuple[int, int]]:
    """Return, for each chunk with its indexes, its end and the number of ticks in the file up to there."""
    names = places(content)
    end_of_data = names.index("data end, head")
    starts = [k for k in range(1, end_of_data) if names[k] == "chunk, head" != names[k - 1]]
    size = tick_dtype(len(JOINTS)).itemsize
    return [(after, len(told(content[:after])[0]) // size) for after in [*starts[1:], end_of_data]]


def chosen(names: list[str], most: int) -> list[int]:
    """Choose places of each kind, evenly spread; the first mark is left out, because it makes the file an MCAP."""
    kinds = np.array(names)
    spread = []
    for kind in sorted(set(names) - {"magic"}):
        of_kind = np.flatnonzero(kinds == kind)
        spread += of_kind[np.unique(np.linspace(0, len(of_kind) - 1, most).astype(int))].tolist()
    return sorted(spread)


def images(content: bytes, places: list[int]) -> Iterator[tuple[str, int, bytes]]:
    """Yield the damage to a file, the first byte that it changes, and the damaged content."""
    rng = np.random.default_rng(1)
    for place in places:
        yield "cut", place, content[:place]
        altered = bytearray(content)
        altered[place] ^= 1 << int(rng.integers(8))
        yield "altered", place, bytes(altered)
    for place in places[::4]:
        end = min(place - place % SECTOR + SECTOR, len(content))
        if any(content[place:end]):
            first = place + next(k for k, byte in enumerate(content[place:end]) if byte)
            yield "torn", first, content[:place] + bytes(end - place) + content[end:]


@pytest.mark.parametrize("most", [20, pytest.param(3000, marks=pytest.mark.slow)])
def test_every_image_gives_back_the_content_before_its_damage_and_no_other(most: int, content: bytes):
    ticks, others, ending = told(content)
    assert ending is FileEnding.COMPLETE
    size, names, chunks, seen = tick_dtype(len(JOINTS)).itemsize, places(content), whole_until(content), Counter()
    assert chunks[-1][1] * size == len(ticks) == CHUNKS * TICKS * size
    for kind, place, image in images(content, chosen(names, most)):
        some_ticks, some_others, some_ending = told(image)
        assert ticks.startswith(some_ticks), (kind, place)
        assert some_others == others[: len(some_others)], (kind, place)
        promised = max((count for end, count in chunks if end <= place), default=0)
        assert len(some_ticks) >= promised * size, (kind, place, names[place])
        assert some_ending is not FileEnding.COMPLETE, (kind, place, names[place])
        seen[f"{kind}: {names[place]}"] += 1
    assert seen.total() >= (10_000 if most > 1000 else 500)
    print(seen.total(), "images", dict(seen))

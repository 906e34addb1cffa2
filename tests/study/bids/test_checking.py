"""Each way to damage a valid data set that the BIDS validator accepts is reported with its own sentence."""

import gzip
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from exograv.study.bids.checking import problems_of
from exograv.study.bids.manifest import MANIFEST, read_manifest
from exograv.study.dataset.sources import sha256_of

from .small_study import CODES

STEM = f"sub-{CODES[0]}_ses-training01"
FOLDER = f"sub-{CODES[0]}/ses-training01"
EXO = f"{FOLDER}/motion/{STEM}_task-pointing_tracksys-exo"
MOTION, CHANNELS, EVENTS = f"{EXO}_motion.tsv", f"{EXO}_channels.tsv", f"{EXO}_events.tsv"
SIDECAR = f"{EXO}_motion.json"
BEHAVIOUR, SCANS = f"{FOLDER}/beh/{STEM}_task-pointing_beh.tsv", f"{FOLDER}/{STEM}_scans.tsv"
Break = Callable[[Path], object]


@pytest.fixture
def dataset(exported: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(exported, tmp_path / "bids"))


def in_lines(name: str, change: Callable[[list[str]], list[str]]) -> Break:
    def breaks(root: Path) -> None:
        lines = (root / name).read_text().splitlines()
        (root / name).write_text("".join(f"{line}\n" for line in change(lines)))

    return breaks


def in_cell(name: str, row: int, column: int, value: str) -> Break:
    def change(lines: list[str]) -> list[str]:
        cells = lines[row].split("\t")
        cells[column] = value
        return [*lines[:row], "\t".join(cells), *lines[row + 1 :]]

    return in_lines(name, change)


def in_sidecar(name: str, value: int) -> Break:
    def breaks(root: Path) -> None:
        about = json.loads((root / SIDECAR).read_text())
        (root / SIDECAR).write_text(json.dumps({**about, name: value}))

    return breaks


def added(name: str) -> Break:
    def breaks(root: Path) -> None:
        (root / name).write_text("0\n")

    return breaks


WRONG: dict[str, tuple[Break, str]] = {
    "a header was left": (in_lines(MOTION, lambda lines: ["\t".join("abcdefghijk"), *lines]), "not a number or"),
    "a word in a cell": (in_cell(MOTION, 100, 3, "fast"), "not a number or"),
    "an empty cell": (in_cell(MOTION, 100, 3, ""), "not a number or"),
    "not a number": (in_cell(MOTION, 100, 3, "nan"), "not a finite number"),
    "a row is shorter": (in_lines(MOTION, lambda lines: [*lines[:50], "0.5\t1", *lines[51:]]), "different lengths"),
    "a column is missing": (
        in_lines(MOTION, lambda lines: [line.rpartition("\t")[0] for line in lines]), "10 columns, but .* describes 11",
    ),
    "a channel is missing": (in_lines(CHANNELS, lambda lines: lines[:-1]), "11 columns, but .* describes 10"),
    "a channel of another type": (in_cell(CHANNELS, 2, 2, "MISC"), "number of channels of type JNTANG, MISC"),
    "a row is missing": (in_lines(MOTION, lambda lines: [*lines[:50], *lines[51:]]), "1199 rows, but .* counts 1200"),
    "nothing is left": (in_lines(MOTION, lambda _: []), "the table is empty"),
    "the last row has no end": (
        lambda root: (root / MOTION).write_text((root / MOTION).read_text()[:-1]), "last row has no end",
    ),
    "time goes back": (in_cell(MOTION, 100, 0, "0.5"), "LATENCY"),
    "time stands": (in_cell(MOTION, 100, 0, "0.99"), "LATENCY"),
    "no latency": (in_cell(MOTION, 100, 0, "n/a"), "LATENCY"),
    "time begins later": (in_cell(MOTION, 0, 0, "0.001"), "LATENCY"),
    "a wrong count": (in_sidecar("MotionChannelCount", 12), "MotionChannelCount"),
    "an event out of order": (in_cell(EVENTS, 2, 0, "11.5"), "order of their onsets"),
    "an event without time": (in_cell(EVENTS, 2, 0, "n/a"), "onset is not a number"),
    "a touch is missing in events": (
        in_lines(EVENTS, lambda lines: [line for line in lines if "rejected_touch" not in line]), "2 touches, but .* 3",
    ),
    "a touch is missing in behaviour": (in_lines(BEHAVIOUR, lambda lines: lines[:-1]), "3 touches, but .* 2"),
    "a file is not listed": (in_lines(SCANS, lambda lines: lines[:-1]), "existing files differ"),
    "a listed file is not there": (in_cell(SCANS, 1, 0, "beh/other_beh.tsv"), "existing files differ"),
    "a file is listed twice": (in_lines(SCANS, lambda lines: [*lines, lines[-1]]), "existing files differ"),
    "no list": (lambda root: (root / SCANS).unlink(), "has no _scans.tsv"),
    "somebody who is not known": (
        in_lines("participants.tsv", lambda lines: lines[:-1]), f"sub-{CODES[1]} is not in participants.tsv",
    ),
    "somebody twice": (in_lines("participants.tsv", lambda lines: [*lines, lines[-1]]), "more than once"),
    "no participants": (lambda root: (root / "participants.tsv").unlink(), "participants.tsv is missing"),
    "a name": (in_cell("participants.tsv", 0, 2, "Last_Name"), "may identify a person"),
    "a birthday": (in_cell("participants.tsv", 0, 2, "birth_date"), "may identify a person"),
    "a flipped bit in a raw file": (
        lambda root: _flip(next(root.rglob("*.mcap"))), r"sourcedata/.* hash differs",
    ),
    "a file too many": (added("derivatives/exograv/notes.txt"), "not in the manifest"),
    "a file too few": (lambda root: (root / "derivatives/exograv/touches.parquet").unlink(), "but missing"),
}  # fmt: skip


def _flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.unlink()  # the file may be a hard link to the study's own file
    path.write_bytes(bytes(content))


def renew_manifest(root: Path) -> None:
    """Write the manifest again, so that only the check under test can find the error."""
    names = [name for name in read_manifest(root) if (root / name).exists() and not name.startswith("sourcedata/")]
    old = {name: sha256 for name, sha256 in read_manifest(root).items() if name.startswith("sourcedata/")}
    found = {**old, **{name: sha256_of(root / name) for name in names}}
    (root / MANIFEST).write_text("".join(f"{sha256}  {name}\n" for name, sha256 in sorted(found.items())))


@pytest.mark.parametrize("what", WRONG)
def test_what_is_broken_is_named(dataset: Path, what: str):
    breaks, sentence = WRONG[what]
    breaks(dataset)
    if "too few" not in what:
        renew_manifest(dataset)
    problems = problems_of(dataset)
    assert any(re.search(sentence, problem) for problem in problems), problems


def test_a_good_data_set_has_no_problem(dataset: Path):
    renew_manifest(dataset)
    assert problems_of(dataset) == []


@pytest.mark.parametrize("name", [MOTION, EVENTS, BEHAVIOUR, "README.md", "participants.json"])
def test_any_file_that_changed_is_found_by_its_hash(dataset: Path, name: str):
    with (dataset / name).open("a") as file:
        file.write(" ")
    assert any(name in problem and "hash differs" in problem for problem in problems_of(dataset))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda text: "latency\tlead\n" + text, "not a number or"),
        (lambda text: text.replace("\n", "\t1\n"), "columns"),
        (lambda text: text + text, "latency does not begin"),
    ],
)
def test_devices_are_checked_like_motion(dataset: Path, change: Callable[[str], str], sentence: str):
    path = next(dataset.rglob("*_physio.tsv.gz"))
    text = gzip.decompress(path.read_bytes()).decode()
    path.write_bytes(gzip.compress(change(text).encode()))
    assert any("physio" in problem and sentence in problem for problem in problems_of(dataset, with_hashes=False))

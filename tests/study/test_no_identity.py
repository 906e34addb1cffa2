"""No file, file name, log, output or error contains a person's identity, whatever a user types or adds."""

import io
import json
import sys
import tempfile
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.study.made_up_sessions import settings as session_settings
from tests.study.made_up_sessions import write_session

from exograv import cli
from exograv.study.participants import identities
from exograv.study.participants.searching import files_with

FIRST = ("Jörg", "Zoë", "Anna Maria", "Łukasz", "Siân", "Hannelore")
LAST = ("Müller-Lüdenscheidt", "O'Brien", "van der Straaten", "Çelik Özgür", "Wassermann")
HEADER = "participant,protocol,session,window,t_s,x_px,y_px,target_x_px,target_y_px,gravity_level"
CHEAP = 2**10
"""Cost of scrypt; a test need not withstand an attack."""


@dataclass(frozen=True)
class Person:
    first: str
    last: str
    number: int

    @property
    def name(self) -> str:
        return f"{self.first} {self.last}"

    @property
    def phone(self) -> str:
        return f"+49 170 {self.number}"

    @property
    def mail(self) -> str:
        plain = unicodedata.normalize("NFKD", self.last).encode("ascii", "ignore").decode().replace(" ", "")
        return f"{plain.lower()}{self.number}@example.org"

    @property
    def words(self) -> list[str]:
        """Words that no file may contain."""
        parts = [*self.first.split(), *self.last.split(), self.name, self.mail, self.phone, str(self.number)]
        return [form for part in parts if len(part) > 3 for form in (part, unicodedata.normalize("NFD", part))]


people = st.builds(Person, st.sampled_from(FIRST), st.sampled_from(LAST), st.integers(1_000_000, 9_999_999))


@dataclass
class Terminal:
    """Commands in this process, and all their output."""

    folder: Path
    said: list[str] = field(default_factory=list)

    def run(self, *words: str, typed: str = "") -> int:
        out, status = io.StringIO(), 0
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["exograv", "study", *words])
            patch.setattr(sys, "stdin", io.StringIO(typed))
            patch.setattr(sys, "stdout", out)
            patch.setattr(sys, "stderr", out)
            patch.setenv("EXOGRAV_IDENTITIES_PASSPHRASE", "a long enough passphrase")
            try:
                cli.main()
            except SystemExit as end:
                status = int(end.code or 0)
        self.said.append(out.getvalue())
        return status


def begun(terminal: Terminal, study: str) -> str:
    assert terminal.run("init", study) == 0
    told = ("--consent", "v2", "--age", "34", "--height", "178", "--mass", "74", "--sex", "f")
    assert terminal.run("participant", study, "new", "--group", "trained", *told) == 0
    return terminal.said[-1].strip()


def refused_words(study: str, code: str, person: Person) -> list[Sequence[str]]:
    """Arguments that a user might type into the wrong place."""
    name = person.name
    return [
        ("participant", study, "new", "--group", name),
        ("participant", study, "new", "--consent", name),
        ("participant", study, "erase", name, "--confirm", name),
        ("participant", study, "erase", code, "--confirm", name),
        ("identity", study, "show", name),
        ("add", study, "nothing.mcap", "--participant", name),
        ("add", study, "nothing.mcap", "--acquired", name),
        ("add", study, "nothing.mcap", "--new-code", f"{name}={name}"),
    ]


def named_files(folder: Path, code: str, person: Person) -> list[Path]:
    """Files with the name in their file name and in wrong places of their content."""
    row = f"{code},training,3,1,10.5,990,500,960,540,0"
    texts = {
        f"{person.name}.csv": f"{HEADER},name\n{row},{person.name}\n",
        f"{person.last}.csv": f"{HEADER}\n{row}\n{person.name}{row[len(code) :]}\n{row},{person.name}\n",
        f"{person.last} protocol.csv": f"{HEADER}\n{row.replace('training', 'Hannelore')}\n",
        f"{person.first}.mcap": f"Dear {person.name}",
        f"{person.first}.xdf": f"XDF of {person.name}",
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    by_name = write_session(folder / f"{person.last} 1.mcap", session_settings(person.name))
    cut = write_session(folder / f"{person.name} cut.mcap", session_settings(code, session=2))
    cut.write_bytes(cut.read_bytes()[:-500])
    good = write_session(folder / f"{person.name}.mcap", session_settings(code))
    return [folder / name for name in texts] + [by_name, cut, good, folder / f"{person.name} lost.mcap"]


@pytest.mark.slow
@settings(max_examples=4, derandomize=True, deadline=None)
@given(people)
def test_no_identity_is_anywhere_after_a_whole_study(person: Person):
    with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as place:
        patch.setattr(identities, "COST", CHEAP)
        patch.setattr(identities.write_identities, "__defaults__", (CHEAP,))
        study, terminal = str(Path(place) / "study"), Terminal(Path(place))
        code = begun(terminal, study)
        told = json.dumps({"name": person.name, "contact": f"{person.phone}, {person.mail}"})
        assert terminal.run("identity", study, "add", code, typed=told) == 0
        terminal.run("identity", study, "add", code, typed=person.name)
        assert all(terminal.run(*words) != 0 for words in refused_words(study, code, person))
        incoming = Path(place) / "in"
        incoming.mkdir()
        figures = Path(place) / "study" / "figures.json"
        assert terminal.run("add", study, *map(str, named_files(incoming, code, person)), "--json", str(figures)) == 1
        counts = json.loads(figures.read_text())["counts"]
        assert (counts["added"], counts["refused"]) == (3, 7)
        assert terminal.run("status", study, "--json", str(figures)) == 0
        assert terminal.run("identity", study, "list") == 0
        found = [(path.name, where) for path, where in files_with(Path(study), person.words)]
        assert found == []
        sealed = Path(study).with_suffix(".identities").read_bytes()
        spoken = "".join(terminal.said)
        for word in person.words:
            assert word.encode() not in sealed
            assert word.lower() not in spoken.lower()
        assert terminal.run("identity", study, "show", code) == 0
        assert person.name in terminal.said[-1]

"""Log of mutants: results of earlier runs, each valid as long as the tests that it depends on."""

import ast
import json
from pathlib import Path
from typing import Any

from guard_mutants import Room, digest
from mutant_runs import Result


def digest_of(*files: Path) -> str:
    """Return a short hash of the contents of files."""
    return digest(*(file.read_text(encoding="utf-8") for file in files))


def digests_of(files: list[Path]) -> dict[str, str]:
    """Return a hash of each test, with all that is no test in its module and in the modules that this one imports."""
    trees = {file.stem: ast.parse(file.read_text(encoding="utf-8")) for file in files}
    own, imported, tests = dict[str, str](), dict[str, set[str]](), dict[str, dict[str, str]]()
    for name, tree in trees.items():
        imports = [one for one in tree.body if isinstance(one, ast.Import | ast.ImportFrom)]
        is_test = [isinstance(one, ast.FunctionDef) and one.name.startswith("test_") for one in tree.body]
        imported[name] = {one.module or "" for one in imports if isinstance(one, ast.ImportFrom) and one.level} & {
            *trees
        }
        pairs = list(zip(tree.body, is_test, strict=True))
        own[name] = "\n".join(ast.unparse(one) for one, test in pairs if not test and one not in imports)
        tests[name] = {one.name: ast.unparse(one) for one, test in pairs if test and isinstance(one, ast.FunctionDef)}

    def needed(name: str) -> set[str]:
        return {name}.union(*(needed(other) for other in imported[name]))

    return {
        f"{name}.py::{test}": digest(text, *(own[other] for other in sorted(needed(name))))
        for name in trees
        for test, text in tests[name].items()
    }


class Log:
    """Results of earlier runs."""

    def __init__(self, path: Path, room: Room):
        self.path, self.known, files = path, dict[str, dict](), room.files
        self.tests = digest_of(*files)
        self.digests = digests_of(files)
        """Hash of each test, as it was at the begin."""
        self.read()

    def read(self) -> None:
        """Read what this process and others have noted."""
        if self.path.is_file():
            for line in self.path.read_text(encoding="utf-8").splitlines():
                entry = json.loads(line)
                self.known[entry["key"]] = entry

    def result(self, key: str) -> bool | None:
        """Return True if the mutant was killed, and None if its result is not known or not valid any more."""
        entry = self.known.get(key)
        if entry is None:
            return None
        return entry["killed"] if entry["tests"] == self._valid(entry.get("killer", "")) else None

    def _valid(self, killer: str) -> str:
        return self.digests.get(Path(killer).name.split("[")[0], self.tests)

    def note(self, key: str, name: str, result: Result) -> None:
        """Append a result."""
        code, killer, _ = result
        self.add({"key": key, "killed": code != 0, "name": name, "code": code, "killer": killer})

    def add(self, entry: dict[str, Any]) -> None:
        """Append an entry, which is valid as long as its tests."""
        entry["tests"] = self._valid(entry.get("killer", ""))
        self.known[entry["key"]] = entry
        with self.path.open("a", encoding="utf-8") as log:
            log.write(json.dumps(entry) + "\n")

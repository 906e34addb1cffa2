"""Check the language of docstrings and test names, and print statistics of it.

    python benchmarks/language.py [FOLDER ...] [--check | --sample N --seed S]

A docstring starts with a verb in the imperative, or with a noun. The script finds docstrings of modules, classes,
functions and fields that start with a word of `FORBIDDEN`, and names of tests over 100 characters. Ruff's rule D401
finds other moods of verbs. With `--check` it prints each place and exits with status 1 if there is any.

With `--sample N` it prints N random docstrings, each with file, line and name. A reader who does not know the code
judges each of them at first reading. docs/results/language.md has the earlier results.
"""

import argparse
import ast
import inspect
import random
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("src", "tests", "benchmarks", "examples")

PRONOUNS = "What Of One Whether Who Whoever That As Likewise Nobody Somebody Whose Those Its It Such Nothing Everything"
CONJUNCTIONS = "How Why Where Which When So But And If"
PREPOSITIONS = "By From In Between For To On At With Without After Before Over Beyond Per"
FORBIDDEN = frozenset(f"{PRONOUNS} {CONJUNCTIONS} {PREPOSITIONS}".split())
"""First words of clauses that have no subject."""

LONGEST_TEST_NAME = 100
FEW_WORDS = 3

FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef

Place = tuple[Path, int, str]


def docstrings(path: Path) -> Iterator[tuple[int, str, str]]:
    """Yield line, name and text of each docstring of a file, those of fields included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        body = getattr(node, "body", None)
        if not isinstance(body, list) or not isinstance(node, ast.Module | ast.ClassDef | FUNCTIONS):
            continue
        is_first = [True, *(isinstance(before, ast.Assign | ast.AnnAssign) for before in body[:-1])]
        if isinstance(node, FUNCTIONS):
            is_first[1:] = [False] * (len(body) - 1)
        for before, statement, may_document in zip([node, *body[:-1]], body, is_first, strict=True):
            match statement:
                case ast.Expr(value=ast.Constant(value=str(text))) if may_document and text.strip():
                    yield statement.lineno, name_of(node, before), text


def name_of(node: ast.Module | ast.ClassDef | FUNCTIONS, documented: ast.AST) -> str:
    """Name of the class, function or field that a docstring documents; "module" for that of a file."""
    owner = "module" if isinstance(node, ast.Module) else node.name
    match documented:
        case ast.AnnAssign(target=target) | ast.Assign(targets=[target]):
            return ast.unparse(target) if owner == "module" else f"{owner}.{ast.unparse(target)}"
        case _:
            return owner


def first_word(text: str) -> str:
    """First word of a text, without punctuation."""
    return text.split()[0].strip(".,:;'\"`")


def sources(folders: list[str]) -> list[Path]:
    """Python files below folders of the project, in order."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def forbidden_beginnings(paths: list[Path]) -> list[Place]:
    """Docstrings that start with a word of `FORBIDDEN`."""
    return [
        (path, line, f"'{text.splitlines()[0]}' starts with '{first_word(text)}'. Start with a verb or a noun.")
        for path in paths
        for line, _, text in docstrings(path)
        if first_word(text) in FORBIDDEN
    ]


def long_test_names(paths: list[Path]) -> list[Place]:
    """Names of tests over 100 characters."""
    return [
        (path, number, f"'{name}' has {len(name)} characters; allowed: {LONGEST_TEST_NAME}.")
        for path in paths
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for name in re.findall(r"def (test_\w+)", line)
        if len(name) > LONGEST_TEST_NAME
    ]


def print_statistics(paths: list[Path]) -> None:
    """Print counts of docstrings by room, and the shares of unclear ones."""
    total, forbidden, short, words = (Counter[str]() for _ in range(4))
    for path in paths:
        parts = path.relative_to(ROOT).parts
        room = "/".join(parts[1:3] if parts[0] == "src" else parts[:1])
        for _, _, text in docstrings(path):
            total[room] += 1
            forbidden[room] += first_word(text) in FORBIDDEN
            short[room] += len(text.split()) <= FEW_WORDS
            words[room] += len(text.split())
    print(f"{'room':32} docstrings  forbidden beginning  <= {FEW_WORDS} words   words")
    for room in total:
        print(f"{room:32} {total[room]:10} {forbidden[room]:20} {short[room]:11} {words[room]:7}")
    for name, counter in (("forbidden beginning", forbidden), (f"<= {FEW_WORDS} words", short)):
        print(f"{name}: {counter.total()} of {total.total()}, {counter.total() / max(total.total(), 1):.1%}")

    print(f"words of docs, without generated pages and punctuation: {words_of_docs()}")


def words_of_docs() -> int:
    """Return the number of words on the pages of docs; a word has a letter or a digit."""
    pages = [path for path in (ROOT / "docs").rglob("*.md") if not {"generated", "_build"} & set(path.parts)]
    return sum(bool(re.search(r"\w", word)) for page in pages for word in page.read_text(encoding="utf-8").split())


def print_sample(paths: list[Path], size: int, seed: int) -> None:
    """Print random docstrings, each with file, line and name."""
    every = [(path, *found) for path in paths for found in docstrings(path)]
    for number, (path, line, name, text) in enumerate(random.Random(seed).sample(every, min(size, len(every))), 1):
        print(f"{number}. {path.relative_to(ROOT)}:{line} {name}\n{inspect.cleandoc(text)}\n")


def main() -> int:
    """Parse the command line, print, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", default=FOLDERS)
    parser.add_argument("--check", action="store_true", help="print each place; exit status 1 if there is any")
    parser.add_argument("--sample", type=int, metavar="N", help="print N random docstrings")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the sample; default 0")
    options = parser.parse_args()
    paths = sources(options.folders)
    if options.sample:
        print_sample(paths, options.sample, options.seed)
        return 0
    if not options.check:
        print_statistics(paths)
        return 0
    places = forbidden_beginnings(paths) + long_test_names(paths)
    for path, line, text in places:
        print(f"{path.relative_to(ROOT)}:{line}: {text}")
    print(f"{len(places)} places in {len(paths)} files.")
    return 1 if places else 0


if __name__ == "__main__":
    sys.exit(main())

"""Report of the proof: lines for a terminal, and a page."""

import ast
from collections.abc import Sequence

from .judge import Verdict
from .source import Source

HEAD = """\
# Proof of the guard

Made by `python benchmarks/proof/prove.py --save docs/results/proof.md`; do not edit. Method, assumptions, and
what is not proved: [the compiled guard](../explanation/guard.md#proof).

"""


def row(one: Verdict) -> str:
    """Return a property as lines for a terminal."""
    results = {**one.promises, **one.duties}
    good = sum(result == "proved" for result in results.values())
    lines = [f"{one.name}: {good} of {len(results)} proved, {one.seconds:.0f} s"]
    lines += [f"  {name}: {result}" for name, result in results.items() if result != "proved"]
    if one.example:
        lines.append(f"  {one.example}")
    return "\n".join(lines)


def page(verdicts: list[Verdict], source: Source) -> str:
    """Return the page of the results: the parts of the guard, and a row per claim."""
    results = {one.name: [*one.promises.values(), *one.duties.values()] for one in verdicts}
    every = [result for own in results.values() for result in own]
    open_ = {part: own for part, own in results.items() if _proved(own) < len(own)}
    undecided = [f"{part} ({_proved(own)} of {len(own)} proved)" for part, own in open_.items()]
    lines = [
        f"{_proved(every)} of {len(every)} claims are proved, in {sum(one.seconds for one in verdicts):.0f} s of "
        "processor time. A part of the guard is one of its functions, or several calls of one. Each part is proved by "
        "itself. The two halves of a tick call most of these functions.",
        "",
        f"All claims are proved for {len(results) - len(open_)} parts. Some are undecided for: "
        f"{', '.join(undecided) or 'no part'}.",
        "",
        "| claim | meaning | proved in parts | undecided in |",
        "|---|---|---|---|",
    ]
    lines += [
        _claim(name, _meaning(name, source), [(one.name, one.promises.get(name)) for one in verdicts])
        for name in dict.fromkeys(name for one in verdicts for name in one.promises)
    ]
    divided = [(one.name, result) for one in verdicts for result in one.duties.values()]
    lines.append(_claim("divisions", "The guard never divides by zero.", divided))
    return HEAD + "\n".join(lines) + "\n"


def _proved(results: list[str]) -> int:
    return sum(result == "proved" for result in results)


def _claim(name: str, meaning: str, results: Sequence[tuple[str, str | None]]) -> str:
    proved = sum(result == "proved" for _, result in results)
    open_ = [part.removesuffix(" of a tick") for part, result in results if result not in ("proved", None)]
    undecided = dict.fromkeys(open_)
    return f"| {name} | {meaning} | {proved} | {', '.join(undecided)} |"


def _meaning(name: str, source: Source) -> str:
    node = source.functions.get(name)
    if node is None:
        return (
            "The bridge ends at the latest after the allowed number of missed ticks."
            if name.startswith("bridge")
            else "Too many missed ticks start a stop."
        )
    text = " ".join((ast.get_docstring(node) or "").split())
    text = text.removeprefix("Return True if ").removeprefix("Return True ").replace("|", "∣")
    return text[:1].upper() + text[1:]

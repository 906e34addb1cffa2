"""Report of the proof: lines for a terminal, and a page."""

import ast

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
    """Return the page of the results."""
    total = sum(len(one.promises) + len(one.duties) for one in verdicts)
    good = sum(result == "proved" for one in verdicts for result in (*one.promises.values(), *one.duties.values()))
    lines = [
        f"{good} of {total} claims are proved, in {sum(one.seconds for one in verdicts):.0f} s of processor time.",
        "",
    ]
    for one in verdicts:
        functions = ", ".join(f"`{name}`" for name in one.functions if not name.startswith(PREFIXES))
        lines += [f"## {one.name[0].upper()}{one.name[1:]}", "", f"Functions: {functions}. {one.seconds:.0f} s.", ""]
        lines += ["| claim | meaning | result |", "|---|---|---|"]
        lines += [f"| {name} | {_meaning(name, source)} | {result} |" for name, result in one.promises.items()]
        if one.duties:
            proved = sum(result == "proved" for result in one.duties.values())
            left = ", ".join(f"`{name}`".replace("|", "∣") for name, result in one.duties.items() if result != "proved")
            left = f"; undecided: {left}" if left else ""
            lines.append(f"| divisions | No division by zero. | {proved} of {len(one.duties)} proved{left} |")
        lines.append("")
    return HEAD + "\n".join(lines)


PREFIXES = ("holds_", "promise_", "setting_", "state_", "same")


def _meaning(name: str, source: Source) -> str:
    node = source.functions.get(name)
    if node is None:
        return (
            "The guard's own count of missed ticks ends the bridge." if name.startswith("bridge") else "A stop follows."
        )
    text = " ".join((ast.get_docstring(node) or "").split())
    text = text.removeprefix("Return True if ").removeprefix("Return True ").replace("|", "∣")
    return text[:1].upper() + text[1:]

"""Report of the proof: lines for a terminal, and a page."""

from .judge import Verdict

HEAD = """\
# Proof of the guard

Made by `python benchmarks/proof/prove.py --save docs/results/proof.md`; do not edit. Method, assumptions, and
what is not proved: [the compiled guard](../explanation/guard.md#proof). Meaning of each claim:
[claims](../reference/generated/claims.md).

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


def page(verdicts: list[Verdict]) -> str:
    """Return the page of the results: the parts of the guard, and the claims that are undecided."""
    results = {one.name: [*one.promises.values(), *one.duties.values()] for one in verdicts}
    every = [result for own in results.values() for result in own]
    open_ = {part: own for part, own in results.items() if _proved(own) < len(own)}
    undecided = [f"{part} ({_proved(own)} of {len(own)} proved)" for part, own in open_.items()]
    claims = {
        name: [(one.name, one.promises.get(name)) for one in verdicts]
        for name in dict.fromkeys(name for one in verdicts for name in one.promises)
    }
    claims["divisions"] = [(one.name, result) for one in verdicts for result in one.duties.values()]
    lines = [
        f"{_proved(every)} of {len(every)} claims are proved, in {sum(one.seconds for one in verdicts):.0f} s of "
        "processor time. A part of the guard is one of its functions, or several calls of one. Each part is proved by "
        "itself. The two halves of a tick call most of these functions.",
        "",
        f"All claims are proved for {len(results) - len(open_)} parts. Some are undecided for: "
        f"{', '.join(undecided) or 'no part'}.",
        "",
        *(f"- Undecided in the {part}: {', '.join(_undecided(part, claims))}." for part in open_),
    ]
    return HEAD + "\n".join(lines) + "\n"


def _proved(results: list[str]) -> int:
    return sum(result == "proved" for result in results)


def _undecided(part: str, claims: dict[str, list[tuple[str, str | None]]]) -> list[str]:
    """Return the names of the claims that are not proved for a part."""
    return [
        name
        for name, results in claims.items()
        if any(own == part and result not in ("proved", None) for own, result in results)
    ]

"""Report of the proof: a line per property, and a page."""

from .judge import Verdict


def row(one: Verdict) -> str:
    """Return a property as lines for a terminal."""
    good = sum(result == "proved" for result in one.promises.values())
    lines = [f"{one.name}: {good} of {len(one.promises)} proved, {one.seconds:.0f} s"]
    lines += [f"  {name}: {result}" for name, result in one.promises.items() if result != "proved"]
    if one.example:
        lines.append(f"  {one.example}")
    return "\n".join(lines)


def page(verdicts: list[Verdict]) -> str:
    """Return the page of the results."""
    return ""

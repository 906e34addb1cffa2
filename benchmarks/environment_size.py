"""Size of each extra in the environment that runs this script, with everything that it depends on.

    python benchmarks/environment_size.py
    python benchmarks/environment_size.py --largest 15    # also the largest packages of exograv[all]

Sizes are those of the installed files, compiled modules included, from the records of the packages.
"""

import argparse
from collections.abc import Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution

from packaging.requirements import Requirement

MB = 1e6


@cache
def size(name: str) -> float:
    """Return the size of an installed package in MB; 0 if it is not installed."""
    try:
        files = distribution(name).files or []
    except PackageNotFoundError:
        return 0.0
    paths = (file.locate() for file in files)
    return sum(path.stat().st_size for path in paths if path.is_file()) / MB


def needed(name: str, extras: frozenset[str]) -> Iterator[tuple[str, frozenset[str]]]:
    """Return the requirements of a package, with the extras that each is asked for with."""
    for line in distribution(name).requires or []:
        requirement = Requirement(line)
        marker = requirement.marker
        if marker is None or any(marker.evaluate({"extra": extra}) for extra in extras or {""}):
            yield requirement.name.lower().replace("_", "-"), frozenset(requirement.extras)


def closure(extra: str) -> set[str]:
    """Return the packages that exograv with one extra installs."""
    found: set[tuple[str, frozenset[str]]] = set()
    to_do = [("exograv", frozenset({extra}))]
    while to_do:
        one = to_do.pop()
        if one in found:
            continue
        found.add(one)
        try:
            to_do += list(needed(*one))
            to_do += list(needed(one[0], frozenset()))
        except PackageNotFoundError:
            print(f"not installed: {one[0]}")
    return {name for name, _ in found}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=0)
    options = parser.parse_args()
    extras = distribution("exograv").metadata.get_all("Provides-Extra") or []
    rows = {extra: closure(extra) for extra in ("", *extras)}
    print(f"{'extra':12} {'packages':>8} {'size [MB]':>10}")
    for extra, packages in sorted(rows.items(), key=lambda row: sum(map(size, row[1]))):
        print(f"{extra or 'core':12} {len(packages):8} {sum(map(size, packages)):10.0f}")
    for name in sorted(rows["all"], key=size, reverse=True)[: options.largest]:
        print(f"  {name:30} {size(name):6.0f} MB")


if __name__ == "__main__":
    main()

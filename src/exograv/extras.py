"""Extras of the package: which one installs a package that is missing."""

from collections.abc import Sequence
from importlib.util import find_spec

EXTRAS = {
    "canopen": "can",
    "can": "can",
    "casadi": "control",
    "cryptography": "study",
    "distributed": "cluster",
    "edfio": "study",
    "jinja2": "study",
    "llvmlite": "control",
    "markupsafe": "study",
    "matplotlib": "study",
    "mcap": "recording",
    "moteus": "moteus",
    "mujoco": "twin",
    "pandas": "study",
    "pyarrow": "study",
    "pylsl": "lsl",
    "pyxdf": "study",
    "scipy": "control",
    "starlette": "console",
    "statsmodels": "study",
    "uvicorn": "console",
    "weasyprint": "study",
    "websockets": "console",
    "zenoh": "ros2",
    "zstandard": "recording",
}
"""Smallest extra that installs a package, by the name under which it is imported."""

PURPOSES = {
    "mujoco": "The simulated machine needs MuJoCo, which is not installed. A real machine does not: give --drives, "
    "where the command has it",
}
"""Beginning of the sentence for packages that a reader may not connect with the command."""


def missing_package(error: ModuleNotFoundError) -> str | None:
    """Say which extra installs the missing package; None if it belongs to no extra."""
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    purpose = PURPOSES.get(package, f"This needs the package '{package}', which is not installed")
    return f"{purpose}. Install it with: pip install 'exograv[{extra}]', or everything with 'exograv[all]'."


INSIDE = {
    "console": ("recording",),
    "lsl": ("recording",),
    "ros2": ("recording",),
    "study": ("recording",),
    "twin": ("control", "recording"),
}
"""Extras that another extra contains."""


def missing_from(extras: Sequence[str]) -> list[str]:
    """List the packages of these extras that are not installed."""
    every = {*extras, *(inner for extra in extras for inner in INSIDE.get(extra, ()))}
    return [package for package, extra in EXTRAS.items() if extra in every and find_spec(package) is None]


def missing_by_extra() -> dict[str, list[str]]:
    """List the packages of each extra that are not installed."""
    found: dict[str, list[str]] = {extra: [] for extra in sorted(set(EXTRAS.values()))}
    for package, extra in EXTRAS.items():
        if find_spec(package) is None:
            found[extra].append(package)
    return found

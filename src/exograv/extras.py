"""Extras of the package: which one installs a package that is missing."""

EXTRAS = {
    "canopen": "can",
    "can": "can",
    "casadi": "control",
    "cryptography": "study",
    "distributed": "cluster",
    "jinja2": "study",
    "llvmlite": "control",
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
    "mujoco": "The simulated machine needs MuJoCo. A real machine does not: give --drives, where the command has it",
}
"""Beginning of the sentence for packages that a reader may not connect with the command."""


def missing_package(error: ModuleNotFoundError) -> str | None:
    """Say which extra installs the missing package; None if it belongs to no extra."""
    package = (error.name or "").partition(".")[0]
    extra = EXTRAS.get(package)
    if extra is None:
        return None
    purpose = PURPOSES.get(package, f"This needs the package '{package}'")
    return f"{purpose}. '{package}' is not installed; install it with: pip install 'exograv[{extra}]'"

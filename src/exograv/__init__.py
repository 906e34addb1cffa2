"""Gravity compensation of the arm inside an upper-limb exoskeleton: identify the arm, float it, and study the effect.

The names below are the public Python API. Every other module may change between versions.
"""

__version__ = "0.1.0"

_MODULES = {
    "Compensator": "api.compensator",
    "Drives": "api.drives",
    "Estimate": "api.estimate",
    "ExogravError": "errors",
    "Flight": "api.flight",
    "Person": "api.person",
    "PointingSession": "api.pointing",
    "Recording": "api.recording",
    "Study": "api.study",
    "Twin": "api.twin",
    "float_arm": "api.flight",
    "identify": "api.estimate",
    "load_calibration": "api.arm_in_machine",
    "load_rig": "model.description",
}
"""Module of each public name."""


def __getattr__(name: str) -> object:
    """Import a public name on first use (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"Module 'exograv' has no public name '{name}'. Public names: {', '.join(_MODULES)}.")
    from importlib import import_module

    try:
        value = getattr(import_module(f"exograv.{_MODULES[name]}"), name)
    except ModuleNotFoundError as error:
        from .extras import missing_package

        raise ImportError(missing_package(error) or str(error)) from error
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_MODULES])

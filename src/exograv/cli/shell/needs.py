"""Extras that a command needs: a missing one is named before the command starts, and all of them at once."""

from typing import Any

from exograv.errors import ConfigError
from exograv.extras import INSIDE, missing_from

NEEDS: dict[str, tuple[str, ...]] = {
    "demo": ("twin", "study"),
    "report": ("recording", "study"),
    "rig new": ("control",),
    "rig check": ("control", "study"),
    "rig test": ("control", "recording"),
    "rig calibrate": ("control", "recording"),
    "rig self-test": ("control", "recording"),
    "rig accept": ("control", "recording"),
    "rig motion": ("control", "study"),
    "rig export": ("control",),
    "arm identify": ("study",),
    "arm identify-log": ("control", "recording"),
    "arm weigh": ("control", "recording"),
    "arm verify": ("control", "recording"),
    "run live": ("control", "recording"),
    "run console": ("control", "console"),
    "run train": ("study",),
    "run assist": ("twin", "study"),
    "run teach": ("control", "recording"),
    "run repeat": ("control", "recording"),
    "run mirror": ("control", "recording"),
    "run support-level": ("twin", "study"),
    "study add": ("study",),
    "twin fit": ("control", "study"),
    "twin compare": ("twin",),
    "study example": ("twin", "study"),
    "study report": ("study",),
    "study simulate": ("twin", "study"),
    "data view": ("control", "recording"),
    "data replay": ("control", "study"),
    "data sync": ("study",),
    "dev amplifier": ("lsl",),
    "dev benchmark-identification": ("twin", "study"),
    "dev drive-sim": ("twin",),
    "dev faults": ("twin",),
    "dev stimulus": ("console",),
    "dev sweep": ("twin", "study"),
    "dev transparency": ("twin", "study"),
    "dev validate-participant": ("twin",),
}
"""Extras that a command cannot do without. Other commands name the first missing package when they use it."""

ON_DRIVES: dict[str, tuple[str, ...]] = {
    "arm identify": ("control", "recording"),
    "run train": ("control", "console"),
}
"""Extras that a command needs instead if the machine is on drives."""


def extras_of(path: str, options: Any) -> tuple[str, ...]:
    """Extras that a command needs with these options."""
    extras = NEEDS.get(path, ())
    if getattr(options, "is_on_drives", False):
        extras = ON_DRIVES.get(path, extras)
    # Only the twin loads MuJoCo here: simulated drives have a process of their own, which names what it lacks.
    if extras and getattr(options, "is_on_drives", True) is False:
        extras = ("twin", *extras)
    if path == "data view" and options.page is None:
        extras = (*extras, "console")
    return tuple(one for one in extras if not any(one in INSIDE.get(other, ()) for other in extras))


def refuse_missing(path: str, options: Any) -> None:
    """Check before a command starts that its packages are installed.

    Raises:
        ConfigError: A package is missing; the message names all extras of the command.
    """
    extras = extras_of(path, options)
    if missing := missing_from(extras):
        needed = ",".join(one for one in extras if missing_from((one,)))
        raise ConfigError(
            f"`exograv {path}` needs exograv[{needed}]. Install it with: pip install 'exograv[{needed}]', or "
            f"everything with 'exograv[all]'. Missing packages: {', '.join(missing)}."
        )

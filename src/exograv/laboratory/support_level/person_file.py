"""File of a virtual person of little strength."""

from pathlib import Path

import numpy as np
from pydantic import Field, ValidationError

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings
from exograv.procedures.rehabilitation.support_level.options import WeakPersonOptions
from exograv.rig.twin.behaviour.weakness import Weakness, drawn_weakness


class PersonFile(Settings):
    """Virtual person of little strength (docs/howto/support_level.md)."""

    strength: float | list[float] = Field(
        description="Share of a healthy adult's strength; one number, or one per freedom."
    )
    synergy: float = Field(0.0, ge=0.0, le=1.0)
    mobilised_sd: float = Field(0.1, ge=0.0, le=0.5)
    noise: float = Field(0.05, ge=0.0, le=0.5)


def weakness_of(options: WeakPersonOptions, freedoms: int) -> Weakness:
    """Read or draw the weakness of the requested person.

    Raises:
        ConfigError: The file cannot be read, or has a value outside its limits.
    """
    path = options.person_file
    if path is None:
        return drawn_weakness(options.strength_or_usual, options.seed, freedoms, options.synergy or 0.0)
    person = _read(path)
    if isinstance(person.strength, float):
        strength = drawn_weakness(person.strength, options.seed, freedoms).strength
    else:
        strength = np.array(person.strength)
    if len(strength) != freedoms or not ((strength > 0.0) & (strength <= 1.0)).all():
        raise ConfigError(
            f"strength in {path} is {person.strength}; give a number above 0 to 1, or {freedoms} of them, in the order "
            "flexion, abduction, rotation, elbow."
        )
    return Weakness(strength, person.synergy, person.mobilised_sd, person.noise)


def _read(path: Path) -> PersonFile:
    import tomllib

    try:
        return PersonFile.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise ConfigError(f"--person-file {path} cannot be read: {error.strerror}. Check its path.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"--person-file {path} is not a valid TOML file: {error}. Correct it there.") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ConfigError(
            f"--person-file {path}: {where}: {first['msg']}. Allowed entries: strength, synergy, mobilised_sd and "
            "noise."
        ) from error

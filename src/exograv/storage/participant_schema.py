"""Schema of a participant's file: one person in one machine, as identified last."""

import hashlib
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, AwareDatetime, Field, NonNegativeFloat, PositiveFloat, PositiveInt

from exograv.dynamics.parameters import ParameterLayout, names_and_units
from exograv.identification.recursive.previous_session import kept_part
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.rig_settings import Settings
from exograv.options import PersonCode

from .calibration_schema import Identity
from .sealed_file import Sealed

SCHEMA_VERSION = 1
DIGITS = 8
"""Significant digits of mean and covariance [-]; the best known combination has 1e-5 of the table's variance."""
CODE = PersonCode()

Kept = Float[np.ndarray, " kept"]
KeptSquare = Float[np.ndarray, "kept kept"]


def _checked_code(code: str) -> str:
    if not CODE.accepts(code):
        raise ValueError(f"it must have {CODE.text}")
    return code


class StoredPerson(Settings):
    """Person by code, with the body data that were measured by scale and tape."""

    code: Annotated[str, AfterValidator(_checked_code)]
    height_m: PositiveFloat
    mass_kg: PositiveFloat
    sex: Literal["male", "female"]
    lengths_m: dict[str, PositiveFloat]

    @classmethod
    def of(cls, code: str, body: Body) -> "StoredPerson":
        """Return the record of a person with this code and body; lengths are rounded to 0.1 mm."""
        lengths = {name: round(length, 4) for name, length in (body.lengths_m or {}).items()}
        return cls(
            code=code,
            height_m=round(body.height_m, 3),
            mass_kg=round(body.mass_kg, 1),
            sex=body.sex,
            lengths_m=lengths,
        )


class Identified(Settings):
    """Conditions and result of the last identification."""

    at_utc: AwareDatetime
    donnings: PositiveInt
    """Number of donnings that the estimate is based on."""
    method: str
    prior_sha256: str
    """Hash of the anthropometric prior at the first donning."""
    motion: str
    motion_s: PositiveFloat
    calibration_sha256: str
    """Hash of the machine's stored calibration; empty if the calibration was made for this identification only."""
    outcome: str
    predicted_left_over_Nm: list[NonNegativeFloat]
    """RMS residual torque expected from the covariance, per joint over the workspace."""
    held_out_error_Nm: list[NonNegativeFloat]
    """RMS error per joint of the torque predicted one second before its measurement."""
    held_out_s: NonNegativeFloat
    """Duration of that prediction test, at the end of the motion."""


class ParameterRow(Settings):
    """Estimate of one parameter."""

    name: str
    unit: str
    mean: float
    covariance: list[float]
    """Covariance with the parameters before it and with itself."""


class StoredParticipant(Sealed):
    """Content of a participant's file."""

    VERSION: ClassVar[int] = SCHEMA_VERSION
    schema_version: Literal[1]
    person: StoredPerson
    machine: Identity
    identified: Identified
    parameters: Annotated[list[ParameterRow], Field(min_length=1)]

    @property
    def mean(self) -> Kept:
        """Mean of the person's parameters, in the order of `dynamics.parameters`."""
        return np.array([row.mean for row in self.parameters])

    @property
    def covariance(self) -> KeptSquare:
        """Covariance of the person's parameters."""
        square = np.zeros((len(self.parameters),) * 2)
        for i, row in enumerate(self.parameters):
            square[i, : i + 1] = square[: i + 1, i] = row.covariance
        return square


def parameter_names(assembly: Assembly) -> list[str]:
    """Names of a file's rows for this arm in this machine."""
    return [name for name, _ in names_and_units(assembly)][kept_part(ParameterLayout.of(assembly))]


def parameter_rows(
    assembly: Assembly, mean: Float[np.ndarray, " parameter"], covariance: Float[np.ndarray, "parameter parameter"]
) -> list[ParameterRow]:
    """Return the rows of the file: those estimated parameters that belong to the person and not to the machine."""
    kept = kept_part(ParameterLayout.of(assembly))
    units = list(names_and_units(assembly))[kept]
    return [
        ParameterRow(name=name, unit=unit, mean=_short(mean[i]), covariance=_shortened(covariance[i, : i + 1]))
        for i, (name, unit) in enumerate(units)
    ]


def prior_hash(
    assembly: Assembly, table: tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, "parameter parameter"]]
) -> str:
    """SHA-256 of the anthropometric prior of the person, to six digits."""
    kept = kept_part(ParameterLayout.of(assembly))
    numbers = [*table[0][kept], *table[1][kept, kept].ravel()]
    return hashlib.sha256(" ".join(f"{number:.6g}" for number in numbers).encode()).hexdigest()


def _shortened(values: Sequence[float] | Float[np.ndarray, " entry"]) -> list[float]:
    return [_short(value) for value in values]


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")

"""A participant's file comes back bit by bit, and is refused if it is damaged, foreign or of another person."""

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.errors import ConfigError
from exograv.identification.core.interface import Outcome
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import put_together
from exograv.options import PersonCode
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.storage.calibration_file import identity_of
from exograv.storage.participant_file import (
    new_code,
    read_participant,
    refuse_other,
    refuse_other_body,
    refuted_text,
    write_participant,
)
from exograv.storage.participant_schema import (
    DIGITS,
    Identified,
    StoredParticipant,
    StoredPerson,
    parameter_rows,
    prior_hash,
)
from exograv.storage.sealed_file import sealed

NOW = datetime(2026, 11, 21, 12, 0, tzinfo=UTC)
MACHINE = "serial 7"
BODY = Body(1.75, 75.0, "male", {"upper_arm": 0.305, "forearm": 0.262, "hand": 0.19})
SIZE_MAX = 30_000  # bytes: it fits an e-mail, and a folder can hold hundreds


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return put_together(load_rig("recupera_like"), BODY)


@pytest.fixture(scope="module")
def belief(assembly: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Prior of the table, mixed by a random rotation so that all parameters are correlated."""
    mean, covariance = prior(assembly, nominal_machine(assembly.description, assembly.exo.phi))
    generator = np.random.default_rng(0)
    sd = np.sqrt(np.diag(covariance)) + 1e-6
    half = 0.1 * sd[:, None] * generator.standard_normal((len(mean), len(mean)))
    return mean + 0.1 * sd, half @ half.T


@pytest.fixture
def keep(assembly: Assembly, belief: tuple[np.ndarray, np.ndarray], tmp_path: Path) -> Callable[..., Path]:
    def write(
        machine: str = MACHINE, side: str = "right", at: datetime = NOW, outcome: str = Outcome.CONVERGED.value
    ) -> Path:
        identified = Identified(
            at_utc=at,
            donnings=1,
            method="recursive",
            prior_sha256=prior_hash(assembly, belief),
            motion="of the machine's description",
            motion_s=59.76,
            calibration_sha256="",
            outcome=outcome,
            predicted_left_over_Nm=[0.1, 0.1, 0.1, 0.05],
            held_out_error_Nm=[0.5, 0.5, 0.5, 0.2],
            held_out_s=20.0,
        )
        identity = identity_of(assembly.description, machine).model_copy(update={"side": side})
        whole = StoredParticipant(
            schema_version=1,
            person=StoredPerson.of("P-07", BODY),
            machine=identity,
            identified=identified,
            parameters=parameter_rows(assembly, *belief),
        )
        path = tmp_path / "new" / "p.toml"
        write_participant(path, sealed(whole))
        return path

    return write


def test_writing_a_participant_that_was_read_changes_no_bit(keep: Callable[..., Path], tmp_path: Path):
    path = keep()
    again = tmp_path / "again.toml"
    write_participant(again, read_participant(path))
    assert again.read_bytes() == path.read_bytes()
    assert np.array_equal(read_participant(again).covariance, read_participant(path).covariance)


def test_the_file_has_the_parameters_of_the_person_and_none_of_the_machine(
    keep: Callable[..., Path], assembly: Assembly, belief: tuple[np.ndarray, np.ndarray]
):
    whole, kept = read_participant(keep()), slice(0, ParameterLayout.of(assembly).fit.stop)
    np.testing.assert_allclose(whole.mean, belief[0][kept], rtol=10.0 ** (1 - DIGITS))
    np.testing.assert_allclose(whole.covariance, belief[1][kept, kept], rtol=10.0 ** (1 - DIGITS))
    text = keep().read_text()
    assert "rotor_inertia" not in text
    assert "coulomb" not in text


def test_the_file_is_small_and_readable_by_its_owner_only(keep: Callable[..., Path]):
    path = keep()
    assert path.stat().st_size < SIZE_MAX
    assert path.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("line", ["height_m", "mean", "sex", "motion_s", "held_out_error_Nm"])
def test_a_changed_value_is_refused(keep: Callable[..., Path], line: str):
    path = keep()
    text = path.read_text()
    before = next(one for one in text.splitlines() if one.startswith(line))
    digits = before.replace('"male"', '"female"') if line == "sex" else re.sub(r"(\d)(\D*)$", _other_digit, before)
    path.write_text(text.replace(before, digits, 1))
    with pytest.raises(ConfigError, match="damaged"):
        read_participant(path)


def _other_digit(match: re.Match[str]) -> str:
    return f"{(int(match[1]) + 1) % 10}{match[2]}"


def test_half_a_file_is_refused(keep: Callable[..., Path]):
    path = keep()
    path.write_text(path.read_text()[:3000])
    with pytest.raises(ConfigError, match="damaged"):
        read_participant(path)


def test_an_older_version_is_refused(keep: Callable[..., Path]):
    path = keep()
    path.write_text(path.read_text().replace("schema_version = 1", "schema_version = 0"))
    with pytest.raises(ConfigError, match="reads version 1"):
        read_participant(path)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"machine": "serial 8"}, "another machine"),
        ({"side": "left"}, "its side is 'left'"),
        ({"at": NOW + timedelta(days=1)}, "from the future"),
    ],
)
def test_a_foreign_file_is_refused(keep: Callable[..., Path], assembly: Assembly, changes: dict, what: str):
    path = keep(**changes)
    with pytest.raises(ConfigError, match=what):
        refuse_other(path, read_participant(path), assembly, MACHINE, NOW)


def test_a_file_from_before_the_path_of_the_shoulder_had_further_shapes_is_refused(
    keep: Callable[..., Path], assembly: Assembly
):
    path = keep()
    whole = read_participant(path)
    older = whole.model_copy(update={"parameters": whole.parameters[:-12]})
    with pytest.raises(ConfigError, match=r"other parameters than the 55 of this arm\. Identify"):
        refuse_other(path, older, assembly, MACHINE, NOW)


def test_a_file_of_the_same_machine_is_accepted(keep: Callable[..., Path], assembly: Assembly):
    path = keep()
    whole = read_participant(path)
    refuse_other(path, whole, assembly, MACHINE, NOW)
    refuse_other_body(path, whole, BODY)


@pytest.mark.parametrize(
    "told",
    [
        Body(1.80, 75.0, "male", BODY.lengths_m),
        Body(1.75, 85.0, "male", BODY.lengths_m),
        Body(1.75, 75.0, "female", BODY.lengths_m),
        Body(1.75, 75.0, "male", {"upper_arm": 0.34, "forearm": 0.262, "hand": 0.19}),
    ],
)
def test_a_person_of_another_size_is_refused_before_anything_moves(keep: Callable[..., Path], told: Body):
    path = keep()
    with pytest.raises(ConfigError, match="another person"):
        refuse_other_body(path, read_participant(path), told)


@pytest.mark.parametrize("code", ["anna", "Anna-Maria", "P", "P 07", "P07/..", "x" * 16 + "1", ""])
def test_a_name_is_not_a_valid_code(code: str):
    with pytest.raises(ConfigError, match="--code"):
        PersonCode().refuse("--code", code)


def test_random_codes_are_valid_and_differ():
    codes = {new_code() for _ in range(20)}
    assert all(PersonCode().accepts(code) for code in codes)
    assert len(codes) > 15  # of a million


def test_a_file_whose_estimate_disagreed_with_its_check_is_told_as_not_used(keep: Callable[..., Path]):
    text = refuted_text(read_participant(keep(outcome=Outcome.DISAGREES.value)))
    assert "P-07" in text
    assert "identified from the body table" in text


def test_no_other_outcome_of_a_file_is_told_so(keep: Callable[..., Path]):
    for outcome in set(Outcome) - {Outcome.DISAGREES}:
        assert refuted_text(read_participant(keep(outcome=outcome.value))) == ""

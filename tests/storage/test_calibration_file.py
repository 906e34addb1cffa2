"""A calibration comes back unchanged, and is refused if it is damaged, foreign or stale."""

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from exograv.dynamics.friction import Friction
from exograv.errors import ConfigError
from exograv.identification.calibration.empty_machine import Calibration, tilted_gravity
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.storage.calibration_file import (
    identity_of,
    read_calibration,
    refuse_to_replace,
    refuse_unfit,
    take_calibration,
    write_calibration,
)
from exograv.storage.calibration_schema import DIGITS, MeasurementConditions, StoredCalibration, stored

NOW = datetime(2026, 11, 21, 12, 0, tzinfo=UTC)
MACHINE = "serial 7"
ROUNDED = 10.0 ** (1 - DIGITS)


@pytest.fixture(scope="module")
def rig() -> RigDescription:
    return load_rig("recupera_like")


@pytest.fixture(scope="module")
def calibration(rig: RigDescription) -> Calibration:
    phi = read_exoskeleton(rig).phi
    machine = nominal_machine(rig, phi)
    four = np.array([1.0, 2.0, 3.0, 4.0]) / 3.0
    machine = replace(machine, friction=Friction(four, four, 1 + four, four / 9, -four, four / 20, 0.02))
    tilt, small = np.array([0.004, -0.002]), np.full(4, 0.001)
    return Calibration(machine, tilt, np.array([0.001, 0.002]), small, 2 * small, 0.01 * np.abs(phi))


@pytest.fixture
def keep(rig: RigDescription, calibration: Calibration, tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes the calibration as if it had been measured some time ago."""

    def write(ago: timedelta = timedelta(), machine: str = MACHINE, **changes: object) -> Path:
        measured = MeasurementConditions(
            at_utc=NOW - ago, friction_at_utc=NOW - ago, running_s=300.0, lengths_m={"upper_arm": 0.3}
        )
        whole = stored(calibration, identity_of(rig, machine), measured, rig.joints)
        if changes:
            changed = whole.model_copy(update={"identity": whole.identity.model_copy(update=changes)})
            whole = changed.model_copy(update={"content_sha256": changed.hash})
        path = tmp_path / "new" / "calibration.toml"
        write_calibration(path, whole)
        return path

    return write


def test_a_calibration_comes_back_unchanged(calibration: Calibration, keep: Callable[..., Path]):
    again, before = read_calibration(keep()).calibration(), calibration
    for part in ("actuators", "friction", "friction_sd"):
        for name, value in vars(getattr(before.machine, part)).items():
            np.testing.assert_allclose(getattr(getattr(again.machine, part), name), value, rtol=ROUNDED)
    for name in ("phi", "rotor_inertia", "residual_sd", "correlation_s"):
        np.testing.assert_allclose(getattr(again.machine, name), getattr(before.machine, name), rtol=ROUNDED)
    np.testing.assert_allclose(again.machine.gravity, tilted_gravity(before.tilt), rtol=ROUNDED)
    for name in ("tilt", "tilt_sd", "offset", "offset_sd", "phi_sd"):
        np.testing.assert_allclose(getattr(again, name), getattr(before, name), rtol=ROUNDED, atol=1e-12)


def test_writing_a_calibration_that_was_read_changes_nothing(keep: Callable[..., Path], tmp_path: Path):
    path = keep()
    write_calibration(tmp_path / "again.toml", read_calibration(path))
    assert (tmp_path / "again.toml").read_bytes() == path.read_bytes()


def test_writing_leaves_no_half_file_behind(keep: Callable[..., Path]):
    path = keep()
    keep()
    assert [file.name for file in path.parent.iterdir()] == ["calibration.toml"]


def test_a_person_can_read_it(keep: Callable[..., Path]):
    text = keep().read_text(encoding="utf-8")
    assert text.startswith("# Calibration of an empty machine")
    assert 'joint = "elbow_flexion"' in text
    assert "at_utc = 2026-11-21T12:00:00Z" in text
    assert "coulomb_sd_Nm = " in text


def test_every_changed_digit_is_found(keep: Callable[..., Path]):
    path = keep()
    text = path.read_text(encoding="utf-8")
    numbers = [match.span() for match in re.finditer(r"(?<== )-?\d+\.\d+", text)]
    assert len(numbers) > 50
    for start, end in numbers[:: len(numbers) // 20]:
        path.write_text(text[:start] + repr(float(text[start:end]) * 1.01 + 0.01) + text[end:], encoding="utf-8")
        with pytest.raises(ConfigError, match=r"damaged|schema_version"):
            read_calibration(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema_version = 1", "schema_version = 2", r"has schema_version 2; this exograv reads version 1"),
        ("schema_version = 1", "", r"has no schema_version"),
        ("[identity]", "[identity", r"is damaged: it is not valid TOML"),
        ("breakaway = ", "break = ", r"is damaged: joints\.0\.breakaway: Field required"),
        ('side = "right"', 'side = "left"', r"is damaged or edited: its values have the hash"),
    ],
)
def test_a_damaged_file_is_refused_with_the_next_step(keep: Callable[..., Path], old: str, new: str, message: str):
    path = keep()
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=message) as caught:
        read_calibration(path)
    assert "Calibrate again: `exograv rig calibrate`" in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"none\.toml cannot be read"):
        read_calibration(tmp_path / "none.toml")


def test_a_place_that_cannot_be_written_is_named(keep: Callable[..., Path], tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match=r"cannot be written"):
        write_calibration(tmp_path / "file" / "calibration.toml", read_calibration(keep()))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rig": "other"}, r"of another machine: its rig is 'other', this one's is 'recupera_like'"),
        ({"side": "left"}, r"its side is 'left', this one's is 'right'"),
        ({"machine": "serial 8"}, r"its machine is 'serial 8', this one's is 'serial 7'"),
        ({"rig_sha256": "ab" * 32}, r"recupera_like with another rig.toml or URDF \(hash abababababab"),
    ],
)
def test_a_foreign_calibration_is_refused(rig: RigDescription, keep: Callable[..., Path], changes: dict, message: str):
    path = keep(**{"machine": MACHINE} | changes) if "machine" not in changes else keep(machine=changes["machine"])
    with pytest.raises(ConfigError, match=message):
        refuse_unfit(path, read_calibration(path), rig, MACHINE, NOW)


SIMULATED = "simulated, simulated, level 2, seed 3"
TWIN = "twin, level 2, seed 3"
REAL = "serial 8"


@pytest.mark.parametrize(
    ("stored_of", "present"), [(SIMULATED, TWIN), (REAL, MACHINE), (REAL, TWIN), (TWIN, SIMULATED)]
)
def test_the_advice_for_a_calibration_that_is_still_of_use_does_not_replace_it(
    rig: RigDescription, keep: Callable[..., Path], stored_of: str, present: str
):
    path = keep(machine=stored_of)
    make = f"exograv rig calibrate --seed 3 --calibration {path}"
    with pytest.raises(ConfigError) as caught:
        take_calibration(path, rig, present, NOW, make)
    told = str(caught.value)
    assert f"`exograv rig calibrate --seed 3 --calibration {path.with_stem('calibration_2')}`" in told
    assert make not in told
    assert ("simulated drives (--simulate)" in told) == ((stored_of, present) == (SIMULATED, TWIN))


def test_a_calibration_of_another_draw_or_another_description_is_made_again_in_the_same_file(
    rig: RigDescription, keep: Callable[..., Path]
):
    for other, changes in ((SIMULATED.replace("3", "4"), {}), (SIMULATED, {"rig_sha256": "ab" * 32})):
        path = keep(machine=other, **changes)
        with pytest.raises(ConfigError, match="Calibrate again: `exograv rig calibrate`"):
            take_calibration(path, rig, SIMULATED, NOW)


def test_a_calibration_of_a_real_machine_is_not_replaced_by_that_of_another_machine(keep: Callable[..., Path]):
    path = keep(machine=REAL)
    for machine in (MACHINE, TWIN, SIMULATED, "fitted twin 0123456789ab, seed 3"):
        with pytest.raises(ConfigError, match="is the calibration of the machine 'serial 8'"):
            refuse_to_replace(path, machine)
    refuse_to_replace(path, REAL)
    for machine in (TWIN, SIMULATED, "fitted twin 0123456789ab, seed 3"):
        refuse_to_replace(keep(machine=machine), MACHINE)
    refuse_to_replace(path.with_name("none.toml"), MACHINE)
    path.write_text("damaged", encoding="utf-8")
    refuse_to_replace(path, MACHINE)


def test_a_calibration_of_last_month_is_stale(rig: RigDescription, keep: Callable[..., Path]):
    take_calibration(keep(timedelta(days=29)), rig, MACHINE, NOW)
    with pytest.raises(ConfigError, match=r"stale: it was measured 31 days ago; 30 days are allowed"):
        take_calibration(keep(timedelta(days=31)), rig, MACHINE, NOW)


def test_a_calibration_from_the_future_is_refused(rig: RigDescription, keep: Callable[..., Path]):
    take_calibration(keep(-timedelta(minutes=5)), rig, MACHINE, NOW)
    with pytest.raises(ConfigError, match=r"from the future.*Set the clock"):
        take_calibration(keep(-timedelta(hours=1)), rig, MACHINE, NOW)


def test_friction_of_yesterday_warns_and_names_the_recheck(rig: RigDescription, keep: Callable[..., Path]):
    assert take_calibration(keep(timedelta(hours=11)), rig, MACHINE, NOW).warning is None
    warning = take_calibration(keep(timedelta(hours=20)), rig, MACHINE, NOW).warning
    assert warning == (
        "Friction was measured 20 h ago; after 12 h it should be checked: `exograv rig calibrate --recheck`."
    )


def test_equal_values_have_equal_hashes_and_other_values_other_hashes(keep: Callable[..., Path]):
    def sealed(**options) -> StoredCalibration:
        return read_calibration(keep(**options))

    assert sealed().content_sha256 == sealed().content_sha256
    assert sealed().content_sha256 != sealed(ago=timedelta(seconds=1)).content_sha256

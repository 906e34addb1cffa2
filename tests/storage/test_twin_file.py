"""A twin is read as it was written, drawn as its covariance says, and refused for another machine or if damaged."""

from pathlib import Path

import numpy as np
import pytest
from tests.made_twin import CUFFS, WARM_GAIN, made_twin, with_twin_in

from exograv.errors import ConfigError
from exograv.model.description import load_rig
from exograv.storage.sealed_file import sealed
from exograv.storage.twin_file import NAME, StoredTwin, read_twin, write_twin

RIG = load_rig("recupera_like")


@pytest.fixture(scope="module")
def whole() -> StoredTwin:
    return made_twin(RIG)


@pytest.fixture
def folder(tmp_path: Path, whole: StoredTwin) -> Path:
    return with_twin_in(tmp_path / "mine", RIG, whole)


def test_a_twin_is_read_as_it_was_written(folder: Path, whole: StoredTwin):
    assert read_twin(load_rig(str(folder))) == whole


def test_a_file_of_version_1_is_read_with_encoders_on_the_motors_and_gains_that_stay(folder: Path, whole: StoredTwin):
    older = sealed(whole.model_copy(update={"schema_version": 1}))
    path = folder / NAME
    write_twin(path, older)
    added = ("has_motor_encoders", "gain_by_temperature", "cuffs")
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if not line.startswith(added)), encoding="utf-8")
    read = read_twin(load_rig(str(folder)))
    assert read == older
    assert read.has_motor_encoders
    assert not read.gain_by_temperature


def test_the_gain_by_temperature_is_read_as_it_was_written(tmp_path: Path):
    warm = made_twin(RIG, has_motor_encoders=False, gain_by_temperature=[WARM_GAIN])
    read = read_twin(load_rig(str(with_twin_in(tmp_path / "mine", RIG, warm))))
    assert read == warm
    assert read.gain_by_temperature == [WARM_GAIN]


def test_a_file_of_version_2_is_read_without_cuffs(folder: Path, whole: StoredTwin):
    older = sealed(whole.model_copy(update={"schema_version": 2}))
    path = folder / NAME
    write_twin(path, older)
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if not line.startswith("cuffs")), encoding="utf-8")
    read = read_twin(load_rig(str(folder)))
    assert read == older
    assert not read.cuffs


def test_the_cuffs_are_read_as_they_were_written_and_drawn_as_their_covariance_says(tmp_path: Path):
    read = read_twin(load_rig(str(with_twin_in(tmp_path / "mine", RIG, made_twin(RIG, cuffs=[CUFFS])))))
    assert read.cuffs == [CUFFS]
    draws = np.log([CUFFS.draw(seed) for seed in range(2000)])
    sd = [CUFFS.log_stiffness_sd, CUFFS.log_rotational_stiffness_sd]
    # 4.5 standard errors of a mean, and of a standard deviation, of 2000 draws.
    assert (np.abs(draws.mean(axis=0) - CUFFS.mean()) < 0.1 * np.array(sd)).all()
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.08)
    assert np.corrcoef(draws.T)[0, 1] == pytest.approx(CUFFS.correlation, abs=0.08)


def test_draws_have_the_mean_and_the_covariance_of_the_posterior(whole: StoredTwin):
    draws = np.array([whole.draw(seed) for seed in range(2000)])
    sd = np.sqrt(np.diag(whole.posterior.matrix()))
    # 4.5 standard errors of a mean, and of a standard deviation, of 2000 draws.
    assert (np.abs(draws.mean(axis=0) - whole.posterior.mean) < 0.1 * sd + 1e-12).all()
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.08)
    links = whole.layout().links
    mass, moment = links.start, links.start + 1  # a heavier link has larger moments of mass
    covariance = whole.posterior.matrix()
    expected = covariance[mass, moment] / (sd[mass] * sd[moment])
    assert np.corrcoef(draws[:, mass], draws[:, moment])[0, 1] == pytest.approx(expected, abs=0.08)


def test_the_same_seed_gives_the_same_draw(whole: StoredTwin):
    np.testing.assert_array_equal(whole.draw(3), whole.draw(3))
    assert (whole.draw(3) != whole.draw(4)).any()


def test_a_machine_without_a_twin_is_told_how_to_get_one():
    with pytest.raises(ConfigError, match=r"has no twin.toml: this machine has no fitted twin. Fit it: `exograv twin"):
        read_twin(RIG)


def test_a_changed_twin_is_refused(folder: Path):
    path = folder / NAME
    path.write_text(path.read_text().replace("bandwidth_Hz = 25.0", "bandwidth_Hz = 250.0", 1))
    with pytest.raises(ConfigError, match="exograv twin fit"):
        read_twin(load_rig(str(folder)))


def test_a_twin_of_another_machine_is_refused(tmp_path: Path, whole: StoredTwin):
    folder = with_twin_in(tmp_path / "mine", load_rig("nesm_like"), whole)
    with pytest.raises(ConfigError, match="of another machine: its rig is 'recupera_like'"):
        read_twin(load_rig(str(folder)))


def test_a_machine_whose_description_has_changed_needs_a_new_fit(folder: Path):
    path = folder / "rig.toml"
    path.write_text(path.read_text() + "\n# a later remark\n")
    with pytest.raises(ConfigError, match=r"with another rig.toml or URDF"):
        read_twin(load_rig(str(folder)))

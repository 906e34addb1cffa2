"""Identification motion: it starts and ends at rest, for every duration."""

import numpy as np
import pytest

from exograv import motion
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.identification.identify import identification_motion

DT = 1e-3


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))


@pytest.mark.parametrize("seconds", [5.0, 30.0, 60.0])
def test_the_motion_goes_from_rest_to_rest_in_its_time(assembly: Assembly, seconds: float):
    path = identification_motion(assembly, seconds, DT)
    assert path.seconds == pytest.approx(seconds)
    np.testing.assert_allclose(path.v[[0, -1]], 0.0, atol=1e-9)


@pytest.mark.parametrize("seconds", [5.0, 30.0])
def test_position_speed_and_acceleration_belong_together_all_the_way(assembly: Assembly, seconds: float):
    path = identification_motion(assembly, seconds, DT)
    np.testing.assert_allclose(np.diff(path.q, axis=0) / DT, 0.5 * (path.v[1:] + path.v[:-1]), atol=5e-3)
    assert np.abs(np.diff(path.v, axis=0)).max() / DT < 5.0  # rad/s², for excitation and ramp together


def test_the_way_there_and_back_is_the_excitations_own(assembly: Assembly):
    settings = assembly.description.excitation
    centre, sine, cosine = (np.deg2rad(x) for x in (settings.centre_deg, settings.sine_deg, settings.cosine_deg))
    whole = motion.fourier(centre, sine, cosine, settings.period_s, 30.0, DT)
    for q in identification_motion(assembly, 30.0, DT).q[::500]:
        assert np.linalg.norm(whole.q - q, axis=1).min() < 2e-3  # rad: motion of one tick

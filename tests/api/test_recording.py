"""A recording becomes tables whose columns name the joints, and a figure."""

from pathlib import Path

import numpy as np
import pytest

import exograv


@pytest.fixture(scope="module")
def recording() -> exograv.Recording:
    return exograv.Recording(Path("examples/data/floating.mcap"))


def test_a_table_holds_every_tick_and_joint(recording):
    table = recording.to_pandas()
    assert len(table) == recording.channels["/tick"] == len(recording.ticks)
    for k, joint in enumerate(recording.joints):
        np.testing.assert_array_equal(table[f"q_measured.{joint}"], recording.ticks["q_measured"][:, k])


def test_phases_are_a_table(recording):
    assert recording.to_pandas("/phase")["name"].tolist() == ["move", "float"]


def test_a_channel_that_is_not_there_is_named_with_those_that_are(recording):
    with pytest.raises(exograv.ExogravError, match=r"no channel '/ticks'\. Channels: /tick, "):
        recording.to_pandas("/ticks")


def test_a_figure_has_two_panels_for_each_joint(recording, tmp_path):
    figure = recording.plot(tmp_path / "figure.png")
    assert len(figure.axes) == 2 * len(recording.joints)
    assert (tmp_path / "figure.png").stat().st_size > 10_000

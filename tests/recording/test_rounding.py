"""Percentiles of counted durations are those of all durations."""

from collections import Counter

import numpy as np

from exograv.recording.rounding import percentiles


def test_percentiles_of_counted_durations_are_those_of_the_list():
    durations = np.round(np.random.default_rng(3).lognormal(1.0, 0.6, 20_000), 1)
    found = percentiles(Counter(durations.tolist()))
    assert list(found.values()) == np.round(np.percentile(durations, [50.0, 99.0, 99.9]), 1).tolist()

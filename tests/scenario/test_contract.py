"""The JSON of `demo --json` has the promised keys and types, with lists per joint."""

PER_JOINT = 4
PROMISED = {
    "rig": str,
    "method": str,
    "disturbance_level": int,
    "seed": int,
    "joints": list,
    "left_over_rms_Nm": dict,
    "identification": dict,
    "parameters": list,
    "known_weight": dict,
    "float": dict,
    "tick_us": dict,
    "wall_s": float,
    "simulated_s": float,
    "report": str,
}
BEYOND = {
    "calibration",
    "calibration_used",
    "comparison",
    "donning",
    "identifiability",
    "motion",
    "possible_left_over_Nm",
    "recording",
    "world",
}


def test_every_promised_key_is_there_with_its_type_and_nothing_unheard_of(demo):
    assert set(demo.result) == set(PROMISED) | BEYOND
    assert {name: type(demo.result[name]) for name in PROMISED} == PROMISED


def test_left_over_is_a_list_per_joint_of_each_controller(demo):
    left_over = demo.result["left_over_rms_Nm"]
    assert {name: set(part) for name, part in left_over.items()} == {
        "total": {"exo_only", "table", "identified"},
        "arm": {"table", "identified"},
    }
    assert all(len(values) == PER_JOINT for part in left_over.values() for values in part.values())
    assert len(demo.result["joints"]) == PER_JOINT


def test_the_identification_says_how_long_whether_and_why(demo):
    found = demo.result["identification"]
    assert set(found) == {"motion_s", "time_to_target_s", "stop", "outcome", "why", "restless_s", "carried"}
    assert abs(found["motion_s"] - 30.0) < 0.5
    assert found["time_to_target_s"] is None or 0.0 < found["time_to_target_s"] <= 30.0
    assert found["stop"].endswith(".")
    assert found["outcome"].endswith(".")


def test_the_part_of_the_estimate_that_is_carried_is_per_joint(demo):
    carried = demo.result["identification"]["carried"]
    assert len(carried["share"]) == PER_JOINT
    assert all(0.0 <= share <= 1.0 for share in carried["share"])
    assert carried["is_whole"] is (min(carried["share"]) == 1.0)


def test_the_possible_left_over_is_per_joint_and_its_95_percent_lie_above_its_middle(demo):
    possible = demo.result["possible_left_over_Nm"]
    assert set(possible) == {"median", "p95"}
    assert all(0.0 < median < p95 for median, p95 in zip(possible["median"], possible["p95"], strict=True))
    assert len(possible["median"]) == PER_JOINT


def test_a_run_with_other_settings_than_the_reference_says_that_it_has_no_comparison(demo):
    assert "no comparison" in demo.result["comparison"]["text"]
    assert "others_Nm" not in demo.result["comparison"]


def test_every_parameter_has_its_truth_prior_estimate_and_interval(demo):
    for row in demo.result["parameters"]:
        assert set(row) == {"name", "unit", "truth", "prior", "estimate", "ci95"}
        low, high = row["ci95"]
        assert low < row["estimate"] < high or abs(row["estimate"] - low) < high - low


def test_weight_float_and_tick_have_their_keys(demo):
    assert set(demo.result["known_weight"]) >= {"true_kg", "estimated_kg", "ci95_kg"}
    assert set(demo.result["float"]) == {"gravity_level", "drift_deg", "window_s"}
    assert len(demo.result["float"]["drift_deg"]) == PER_JOINT
    tick = demo.result["tick_us"]
    assert set(tick) == {"p50", "p99", "p999"}
    assert tick["p50"] <= tick["p99"] <= tick["p999"]


def test_the_report_is_where_the_result_says(demo):
    page = demo.recording.parent / "report.html"
    assert demo.result["report"] == str(page)
    assert "<svg" in page.read_text(encoding="utf-8")

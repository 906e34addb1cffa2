"""An arm of a third party's model is identified like a drawn one."""

from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples" / "wearers"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm26", "rajagopal"])
def test_a_third_partys_arm_leaves_less_over_once_it_is_identified(run_demo, name: str):
    files = ("--wearer-model", str(EXAMPLES / f"{name}.xml"), "--wearer-map", str(EXAMPLES / f"{name}.toml"))
    result = run_demo("identify", "--seconds", "30", *files).result
    total = result["left_over_rms_Nm"]["total"]
    assert sum(total["identified"]) < 0.7 * sum(total["table"]) < 0.7 * sum(total["exo_only"])
    assert result["wearer_model"]["title"]
    truth = {row["name"]: row["truth"] for row in result["parameters"]}
    assert truth["arm.mass"] == pytest.approx({"arm26": 3.399, "rajagopal": 3.705}[name], abs=0.001)

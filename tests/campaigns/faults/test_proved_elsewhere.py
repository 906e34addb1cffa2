"""Every fault of F01 to F51 has a scenario, a strike, an existing test, or a reason for a missing test."""

import ast
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.syntax import nodes_of

import exograv
from exograv.campaigns.faults.evaluation import figures_of
from exograv.campaigns.faults.fault_table import FAULTS
from exograv.campaigns.faults.fault_tests import TESTED_FAULTS, UNTESTED_FAULTS
from exograv.campaigns.faults.figures import (
    AroundStrikes,
    ReactionTimes,
    StrikeFigures,
    Strikes,
    StruckRun,
)
from exograv.campaigns.faults.strikes import KINDS
from exograv.campaigns.process_faults.cell import Cell
from exograv.campaigns.process_faults.table import reason_absent

ROOT = Path(__file__).parents[3]
PACKAGE = Path(exograv.__file__).parent
MOVES = ("control", "safety", "runtime", "rig", "dynamics")
MOVES_TOO = (
    *(f"live/{name}.py" for name in ("guard_process", "live_control", "live_flight", "live_processes")),
    *(f"loop/{name}.py" for name in ("arm_controller", "control_step", "output_feedback", "phases", "pilot")),
)


def functions(path: Path) -> set[str]:
    return {node.name for node in nodes_of(path) if isinstance(node, ast.FunctionDef)}


def test_each_row_of_the_table_is_accounted_for_and_none_that_is_proved_is_called_missing():
    flown = {name.split()[0] for name in (*FAULTS, *KINDS)}
    proved = {row.id for row in TESTED_FAULTS}
    assert {f"F{k:02d}" for k in range(1, 52)} == (flown | proved | set(UNTESTED_FAULTS)) - {"control"}
    assert not (flown | proved) & set(UNTESTED_FAULTS)


@pytest.mark.parametrize("row", TESTED_FAULTS, ids=lambda row: row.id)
def test_what_proves_a_row_exists(row):
    assert row.proved_by
    for test in row.proved_by:
        file, _, name = test.partition("::")
        assert name in functions(ROOT / file), test


def test_each_cell_that_flies_a_row_at_real_processes_can_be_flown():
    cells = [Cell.of(name) for row in TESTED_FAULTS for name in row.cells]
    assert {row.id for row in TESTED_FAULTS if row.cells} == {"F42", "F43", "F44"}
    assert [reason_absent(cell.process, cell.fault) for cell in cells] == [""] * len(cells)


STAMP_ONLY = ("runtime/ros2/bridge.py", "runtime/ros2/node.py")
"""Modules of a publishing process: ROS stamps use the wall clock, and no torque depends on them."""


def asks_for_the_time_of_day(source: str) -> bool:
    nodes = list(ast.walk(ast.parse(source)))
    words = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    imported = {
        name.name for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)
        for name in node.names
    }  # fmt: skip
    calls = {
        node.attr
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "time"
    }
    return bool(
        calls & {"time", "time_ns", "localtime", "gmtime"}
        or imported & {"datetime", "time_ns"}
        or words & {"CLOCK_REALTIME"}
    )


def test_nothing_that_moves_a_machine_asks_for_the_time_of_day():
    files = [file for name in MOVES for file in (PACKAGE / name).glob("**/*.py")]
    assert all(PACKAGE / name in files for name in STAMP_ONLY)
    files = [file for file in files if file.relative_to(PACKAGE).as_posix() not in STAMP_ONLY]
    files += [PACKAGE / name for name in (*MOVES_TOO, "signals.py", "motion.py")]
    assert len(files) > 50
    assert [str(file) for file in files if asks_for_the_time_of_day(file.read_text("utf-8"))] == []


@pytest.mark.parametrize("source", ["import time\ntime.time()", "from datetime import datetime", "import datetime"])
def test_a_clock_on_the_wall_is_recognised(source: str):
    assert asks_for_the_time_of_day(source)
    assert not asks_for_the_time_of_day("import time\ntime.monotonic_ns()\ntime.sleep(1)")


def strikes(missed: int = 0, **changes: Any) -> Strikes:
    run = StruckRun("", "", 1000, 0, 1000, 0, 0, 0, 0)
    row = StrikeFigures("", 1, 1, 1, ReactionTimes(), 5.0, missed, "DESCENT", None, AroundStrikes(None, None), 0)
    return Strikes(replace(run, **changes), {"F16 live": row}, [])


@pytest.mark.parametrize(
    ("changes", "is_ok"),
    [
        ({}, True),
        ({"not_struck": ["F16 live"]}, True),
        ({"envelope_violations": 1}, False),
        ({"missed": 1}, False),
    ],
)
def test_a_campaign_is_only_in_order_if_all_was_struck_and_nothing_missed(changes: dict[str, Any], is_ok: bool):
    found = figures_of([], {"F01": FAULTS["F01"]}).with_strikes(strikes(**changes))
    assert found.ok == is_ok
    assert set(found.by_fault) == {"F01", "F16 live"}
    assert set(found.not_yet) == set(UNTESTED_FAULTS)

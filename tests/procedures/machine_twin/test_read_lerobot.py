"""LeRobot datasets of formats 2 and 3 and CSV files with their columns give the motion of the machine."""

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from exograv.errors import RecordingError
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.description import load_rig
from exograv.procedures.machine_twin.read_motions import read_motions

RIG = load_rig("recupera_like")
FPS, FRAMES = 200, 600
T = np.arange(FRAMES) / FPS
Q = np.sin(np.outer(T, [1.0, 0.7, 1.3, 0.9]))
CURRENT = 3.0 * np.cos(np.outer(T, [1.1, 0.8, 1.2, 0.6]))
ASKED = CURRENT + 0.1
CELSIUS = 25.0 + np.outer(T, [1.0, 2.0, 3.0, 4.0])
POSITIONS = [f"{joint}.pos" for joint in RIG.joints]
CURRENTS = [f"{joint}.current" for joint in RIG.joints]
TORQUES = [f"{joint}.effort" for joint in RIG.joints]
ROUNDING = 1e-6
"""Tables hold numbers of 32 bits."""


def column(values: np.ndarray) -> pa.Array:
    return pa.array(values.astype(np.float32).tolist(), pa.list_(pa.float32()))


def table(episode: int, state: np.ndarray, action: np.ndarray, more: Mapping[str, np.ndarray]) -> pa.Table:
    columns = {"observation.state": column(state), "action": column(action)}
    columns |= {name: column(values) for name, values in more.items()}
    columns |= {"timestamp": pa.array(T, pa.float32()), "episode_index": pa.array(np.full(FRAMES, episode))}
    return pa.table(columns)


def dataset(
    folder: Path,
    state: np.ndarray,
    names: Mapping[str, object],
    files: tuple[str, ...] = ("file-000.parquet",),
    more: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> Path:
    (folder / "meta").mkdir(parents=True)
    features = {name: {"dtype": "float32", "names": one} for name, one in names.items()}
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "features": features}))
    (folder / "data" / "chunk-000").mkdir(parents=True)
    for episode, file in enumerate(files):
        pq.write_table(table(episode, state, ASKED, more), folder / "data" / "chunk-000" / file)
    return folder


def read(path: Path, is_degrees: bool = False) -> tuple[MeasuredMotion, ...]:
    (recording,) = read_motions(RIG, [path], {}, is_torque=False, is_degrees=is_degrees)
    return recording.motions


def test_a_state_is_read_by_its_names_in_any_order(tmp_path: Path):
    names = {"observation.state": [*CURRENTS, *reversed(POSITIONS)], "action": CURRENTS}
    (motion,) = read(dataset(tmp_path, np.hstack([CURRENT, Q[:, ::-1]]), names))
    np.testing.assert_allclose(motion.q, Q, atol=ROUNDING)
    np.testing.assert_allclose(motion.current, CURRENT, atol=ROUNDING)
    np.testing.assert_allclose(motion.current_asked, ASKED, atol=ROUNDING)


@pytest.mark.parametrize("ending", ["temperature", "temp"])
def test_temperatures_in_the_state_are_those_of_the_motors(ending: str, tmp_path: Path):
    names = {"observation.state": [*POSITIONS, *CURRENTS, *(f"{joint}.{ending}" for joint in RIG.joints)]}
    (motion,) = read(dataset(tmp_path, np.hstack([Q, CURRENT, CELSIUS]), names))
    assert motion.temperature is not None
    np.testing.assert_allclose(motion.temperature, CELSIUS, rtol=ROUNDING)


def test_temperatures_may_be_a_feature_of_their_own(tmp_path: Path):
    names = {"observation.state": [*POSITIONS, *CURRENTS]}
    (motion,) = read(dataset(tmp_path, np.hstack([Q, CURRENT]), names, more={"observation.temperature": CELSIUS}))
    assert motion.temperature is not None
    np.testing.assert_allclose(motion.temperature, CELSIUS, rtol=ROUNDING)


def test_a_table_without_a_temperature_of_each_joint_has_none(tmp_path: Path):
    names = {"observation.state": [*POSITIONS, *CURRENTS, *(f"{joint}.temperature" for joint in RIG.joints[1:])]}
    (motion,) = read(dataset(tmp_path, np.hstack([Q, CURRENT, CELSIUS[:, 1:]]), names))
    assert motion.temperature is None


def test_an_action_of_positions_is_no_command_of_a_current(tmp_path: Path):
    names = {"observation.state": [*POSITIONS, *CURRENTS], "action": POSITIONS}
    (motion,) = read(dataset(tmp_path, np.hstack([Q, CURRENT]), names))
    assert np.isnan(motion.current_asked).all()


def test_grouped_names_of_format_2_and_one_file_per_episode(tmp_path: Path):
    names = {"observation.state": {"motors": [*POSITIONS, *CURRENTS]}}
    files = ("episode_000000.parquet", "episode_000001.parquet")
    motions = read(dataset(tmp_path, np.hstack([Q, CURRENT]), names, files))
    assert [len(motion.t) for motion in motions] == [FRAMES, FRAMES]
    np.testing.assert_allclose(motions[1].q, Q, atol=ROUNDING)


def test_a_state_without_names_has_the_order_of_the_joints_and_efforts_are_torques(tmp_path: Path):
    torque = CURRENT * RIG.nominal_gain
    folder = dataset(tmp_path, np.rad2deg(Q), {}, more={"observation.effort": torque})
    (motion,) = read(folder / "data" / "chunk-000" / "file-000.parquet", is_degrees=True)
    np.testing.assert_allclose(motion.q, Q, atol=ROUNDING)
    np.testing.assert_allclose(motion.current, CURRENT, atol=1e-5)


def test_degrees_without_the_option_are_noticed(tmp_path: Path):
    names = {"observation.state": [*POSITIONS, *CURRENTS]}
    with pytest.raises(RecordingError, match="give --degrees"):
        read(dataset(tmp_path, np.hstack([np.rad2deg(Q), CURRENT]), names))


def test_positions_alone_are_refused_with_the_needed_names(tmp_path: Path):
    with pytest.raises(RecordingError, match=r"shoulder_flexion\.current in observation\.state"):
        read(dataset(tmp_path, Q, {"observation.state": POSITIONS}))


def test_a_csv_with_vectors_in_its_cells_is_read(tmp_path: Path):
    lines = ["timestamp,observation.state,observation.current"]
    for t, q, current in zip(T, Q.tolist(), CURRENT.tolist(), strict=True):
        lines.append(f'{t},"[{", ".join(map(str, q))}]",[{" ".join(map(str, current))}]')
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="utf-8")
    (motion,) = read(tmp_path / "a.csv")
    np.testing.assert_allclose(motion.q, Q)
    np.testing.assert_allclose(motion.current, CURRENT)

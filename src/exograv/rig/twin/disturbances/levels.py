"""Disturbances of the twin at levels 0 (none) to 4 (a bad day); `make docs` writes a page of them.

A pair (a, b) is a uniform range. Each row can also be switched off. The numbers may be widened with a reason. They are
never narrowed to reach a figure.
"""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from exograv.errors import ConfigError
from exograv.options import WorldName

Value = float | tuple[float, float]
"""Number, or the lower and upper end of a uniform range."""

NONE = float("inf")
"""Stiffness, bandwidth or resolution without limit: the effect does not exist."""

ABSENT = (0.0, 0.0, 0.0, 0.0, 0.0)
"""Sizes of effects that a joint without motor does not have, at every level."""


@dataclass(frozen=True)
class LevelRow:
    """Kind of disturbance: its meaning, and its size at each of the levels 0 to 4.

    A disturbance with several cases, such as joints or axes, has one column of sizes per case.
    """

    meaning: str
    columns: Mapping[str, tuple[Value, Value, Value, Value, Value]]
    off: Mapping[str, Value] | None = None
    """Size when switched off, where this is less than at level 0."""
    source: str = ""
    """Source of the sizes; empty if they are our choice."""

    def value(self, column: str, level: int | None) -> Value:
        """Size in a column at a level; `None` is off."""
        if level is not None:
            return self.columns[column][level]
        return self.columns[column][0] if self.off is None else self.off[column]


WEARER: Mapping[str, LevelRow] = MappingProxyType(
    {
        "segment_residual": LevelRow(
            "segment masses and centres against the regression, times the residual SD",
            {"share": (1.0, 1.0, 1.0, 1.5, 2.0)},
            off={"share": 0.0},
            source="Zatsiorsky–Seluyanov regressions",
        ),
        "between_study": LevelRow("factor on segment mass, SD of its logarithm", {"sd": (0.0, 0.04, 0.08, 0.12, 0.20)}),
        "between_arms": LevelRow(
            "second arm of a person against the first: factor on segment mass, SD of its logarithm",
            {"sd": (0.0, 0.01, 0.02, 0.03, 0.05)},
        ),
        "centre_off_axis": LevelRow(
            "centre of mass off the bone axis, SD per axis [mm]", {"sd_mm": (0.0, 3.0, 8.0, 12.0, 15.0)}
        ),
        "length_error": LevelRow(
            "error of the segment lengths given to the software, SD [mm]", {"sd_mm": (0.0, 3.0, 6.0, 10.0, 15.0)}
        ),
        "donning_offset": LevelRow(
            "offset of the shoulder centre, uniform ± per axis [mm]", {"max_mm": (0.0, 5.0, 15.0, 25.0, 30.0)}
        ),
        "glenohumeral_shift": LevelRow(
            "share of the shift of the shoulder centre with elevation", {"share": (0.0, 0.25, 0.5, 1.0, 1.0)}
        ),
        "carrying_angle": LevelRow(
            "forearm outwards from the upper arm's line, elbow extended; mean and SD by sex [°]",
            {
                "male_mean_deg": (0.0, 5.0, 11.0, 11.0, 12.0),
                "male_sd_deg": (0.0, 2.0, 4.0, 4.0, 5.0),
                "female_mean_deg": (0.0, 7.0, 15.0, 15.0, 16.0),
                "female_sd_deg": (0.0, 2.0, 5.0, 5.0, 5.0),
            },
            source=(
                "men 10.97 ± 4.27°, women 15.07 ± 4.95°, 600 students: Paraskevas et al. 2004, Surg Radiol Anat "
                "26:19; it falls steadily with flexion: Ergonomics 48:1645, 2005"
            ),
        ),
        "elbow_axis": LevelRow(
            "turn of the elbow's axis and of the forearm in its frame, SD about each of two axes [°]",
            {"axis_sd_deg": (0.0, 1.0, 3.0, 4.0, 5.0), "forearm_sd_deg": (0.0, 1.0, 2.0, 3.0, 4.0)},
            source="13.1° from the medio-lateral axis in Rajagopal 2016; the spread is our choice",
        ),
        "cuff_stiffness": LevelRow(
            "along and across the limb [N/mm]",
            {"along": (100.0, 6.0, 3.0, 2.1, 2.1), "across": (100.0, 10.0, 6.0, 4.5, 4.5)},
            source="Schiebl 2025 (levels 3, 4)",
        ),
        "cuff_rotation": LevelRow(
            "rotational stiffness about the limb and about the two other axes [N·m/°]",
            {"about_limb": (1.0, 0.06, 0.04, 0.035, 0.03), "about_others": (1.0, 0.3, 0.2, 0.2, 0.18)},
            source="Schiebl 2025 (levels 3, 4)",
        ),
        "cuff_damping": LevelRow("[N·s/m]", {"value": (500.0, 100.0, 60.0, 30.0, 10.0)}, off={"value": 0.0}),
        "passive_stiffness": LevelRow(
            "elasticity of the wearer's joints about their neutral angles [N·m/rad]",
            {
                "shoulder": (0.0, 1.0, (1.0, 2.5), (1.0, 4.0), (2.0, 4.0)),
                "elbow": (0.0, 0.4, (0.4, 1.2), (0.4, 1.8), (1.0, 1.8)),
                "wrist": (0.0, 0.3, (0.3, 1.0), (0.3, 1.5), (0.5, 2.0)),
            },
            source=(
                "elbow: Wiegner & Watts 1986 (levels 3, 4); wrist: Formica et al. 2012, J Neurophysiol, Delp et al. "
                "1996, J Biomech 29:1371 (abstracts; numbers unverified)"
            ),
        ),
        "end_stops": LevelRow(
            "exponential end stops in the last 15° (1: present)",
            {"present": (0.0, 0.0, 1.0, 1.0, 1.0)},
            source="ranges of motion of the wrist: AAOS (unverified)",
        ),
        "hysteresis": LevelRow("hysteresis of the passive torque, share", {"share": (0.0, 0.0, 0.1, 0.3, 0.5)}),
        "passive_damping": LevelRow(
            "[N·m·s/rad]",
            {
                "shoulder": (0.3, 0.3, (0.3, 0.7), (0.3, 1.0), (0.3, 1.0)),
                "elbow": (0.1, 0.1, (0.1, 0.4), (0.1, 0.75), (0.1, 0.75)),
                "wrist": (0.01, 0.01, (0.01, 0.03), (0.01, 0.05), (0.01, 0.05)),
            },
            off={"shoulder": 0.0, "elbow": 0.0, "wrist": 0.0},
        ),
        "slow_bias": LevelRow(
            "not relaxed: slow muscle torque, RMS [N·m]",
            {
                "shoulder": (0.0, 0.1, 0.3, 0.8, 2.0),
                "elbow": (0.0, 0.05, 0.15, 0.4, 1.0),
                "wrist": (0.0, 0.01, 0.03, 0.08, 0.2),
            },
        ),
        # All of these sizes are assumed: docs/howto/participants.md. The first donning of a seed has none of them.
        "day_to_day": LevelRow(
            "next donning against the first, SD: factors on segment mass, on joints' stiffness and damping; neutral "
            "angles [°]; factor on cuff stiffness",
            {
                "mass": (0.0, 0.005, 0.01, 0.015, 0.02),
                "elasticity": (0.0, 0.05, 0.1, 0.15, 0.2),
                "neutral_deg": (0.0, 1.0, 3.0, 5.0, 8.0),
                "cuff": (0.0, 0.1, 0.2, 0.3, 0.4),
            },
        ),
        "bursts": LevelRow(
            "not relaxed: bursts of 2-6 N·m for 0.3-1 s, per minute", {"rate": (0.0, 0.0, 0.5, 3.0, 6.0)}
        ),
    }
)

# Drives at the wrist are small: about a tenth of the shoulder's where harmonic, a fifth where quasi-direct. A row
# without a column for the wrist uses the column of the drive. A joint without motor ("passive") has a bearing and
# nothing else.
MACHINE: Mapping[str, LevelRow] = MappingProxyType(
    {
        "coulomb": LevelRow(
            "Coulomb friction [N·m]",
            {
                "harmonic.shoulder": (1.0, (1.0, 2.0), (1.5, 3.5), (2.0, 4.0), (3.0, 5.0)),
                "harmonic.elbow": (1.0, (1.0, 2.0), (1.5, 2.8), (2.0, 3.0), (2.5, 3.5)),
                "quasi_direct.shoulder": (0.1, (0.1, 0.2), (0.15, 0.4), (0.2, 0.5), (0.3, 0.6)),
                "quasi_direct.elbow": (0.1, (0.1, 0.2), (0.15, 0.4), (0.2, 0.5), (0.3, 0.6)),
                "harmonic.wrist": (0.1, (0.1, 0.2), (0.15, 0.35), (0.2, 0.4), (0.3, 0.5)),
                "quasi_direct.wrist": (0.02, (0.02, 0.04), (0.03, 0.08), (0.04, 0.1), (0.06, 0.12)),
                "passive": (0.02, (0.02, 0.05), (0.03, 0.1), (0.05, 0.15), (0.05, 0.2)),
                "passive.wrist": (0.005, (0.005, 0.01), (0.005, 0.02), (0.01, 0.03), (0.01, 0.05)),
            },
            off=dict.fromkeys(
                (
                    "harmonic.shoulder",
                    "harmonic.elbow",
                    "quasi_direct.shoulder",
                    "quasi_direct.elbow",
                    "harmonic.wrist",
                    "quasi_direct.wrist",
                    "passive",
                    "passive.wrist",
                ),
                0.0,
            ),
            source=(
                "harmonic drives of 28–60 N·m 1.5–4 N·m (unverified), elbow of NESM 2.787 N·m; quasi-direct: AK80-6 "
                "0.184 N·m, hip exoskeletons 0.4 N·m"
            ),
        ),
        "breakaway": LevelRow("breakaway over Coulomb friction", {"ratio": (1.0, 1.1, 1.3, 1.5, 1.8)}),
        "stribeck_velocity": LevelRow(  # level 0 has no Stribeck effect (ratio 1): its value has no effect
            "[rad/s]", {"value": (0.05, 0.05, (0.02, 0.1), (0.02, 0.1), (0.02, 0.1))}
        ),
        "viscous": LevelRow(
            "viscous friction [N·m·s/rad]",
            {
                "harmonic": (0.5, (0.5, 1.0), (0.8, 2.0), (1.0, 3.0), (1.0, 6.0)),
                "quasi_direct": (0.05, 0.05, (0.03, 0.1), (0.05, 0.15), (0.05, 0.2)),
                "harmonic.wrist": (0.05, (0.05, 0.1), (0.08, 0.2), (0.1, 0.3), (0.1, 0.6)),
                "quasi_direct.wrist": (0.01, 0.01, (0.006, 0.02), (0.01, 0.03), (0.01, 0.04)),
                "passive": (0.01, (0.01, 0.02), (0.01, 0.04), (0.02, 0.06), (0.02, 0.1)),
            },
            off=dict.fromkeys(("harmonic", "quasi_direct", "harmonic.wrist", "quasi_direct.wrist", "passive"), 0.0),
            source="harmonic drives 1–6 N·m·s/rad (unverified)",
        ),
        "load_friction": LevelRow(
            "load-dependent friction, share of the load",
            {
                "harmonic": (0.0, 0.02, 0.06, 0.09, 0.12),
                "quasi_direct": (0.0, 0.0, 0.01, 0.02, 0.03),
                "passive": ABSENT,
            },
        ),
        "asymmetry": LevelRow(
            "asymmetry of friction between directions, share", {"share": (0.0, 0.03, 0.08, 0.15, 0.2)}
        ),
        "friction_ripple": LevelRow(
            "over one joint turn of the motor side [N·m]",
            {
                "harmonic": (0.0, 0.03, 0.1, 0.2, 0.4),
                "quasi_direct": (0.0, 0.03, 0.1, 0.2, 0.4),
                "harmonic.wrist": (0.0, 0.003, 0.01, 0.02, 0.04),
                "quasi_direct.wrist": (0.0, 0.006, 0.02, 0.04, 0.08),
                "passive": ABSENT,
            },
        ),
        "warm_up": LevelRow(
            "viscous and Coulomb friction fall over 30 min, share",
            {"share": (0.0, 0.03, 0.1, 0.2, 0.3)},
            source="viscous friction falls by 1–2 %, Coulomb by 0.5 % per kelvin over 20–40 minutes (unverified)",
        ),
        "gain_error": LevelRow(
            "torque constant and efficiency before calibration, SD",
            {"sd": (0.0, 0.02, 0.05, 0.08, 0.1)},
            source="5–10 % between units (unverified)",
        ),
        "rotor_inertia": LevelRow(
            "reflected to the joint [kg·m²]",
            {
                "harmonic": (0.1, (0.1, 0.2), (0.1, 0.4), (0.1, 0.4), (0.1, 0.4)),
                "quasi_direct": (0.01, 0.01, (0.01, 0.03), (0.01, 0.03), (0.01, 0.03)),
                "harmonic.wrist": (0.01, (0.01, 0.02), (0.01, 0.04), (0.01, 0.04), (0.01, 0.04)),
                "quasi_direct.wrist": (0.002, 0.002, (0.002, 0.006), (0.002, 0.006), (0.002, 0.006)),
                "passive": ABSENT,
            },
        ),
        "gear_stiffness": LevelRow(
            "torsional [kN·m/rad]",
            {
                "harmonic": (NONE, 30.0, 15.0, 8.0, 8.0),
                "quasi_direct": (NONE, NONE, NONE, NONE, NONE),
                "harmonic.wrist": (NONE, 3.0, 1.5, 0.8, 0.8),
                "passive": (NONE, NONE, NONE, NONE, NONE),
            },
        ),
        "torque_bandwidth": LevelRow(
            "[Hz]",
            {
                "harmonic": (NONE, 40.0, 25.0, 15.0, 10.0),
                "quasi_direct": (NONE, 80.0, 60.0, 40.0, 30.0),
                "passive": (NONE, NONE, NONE, NONE, NONE),
            },
        ),
        "current_noise": LevelRow(
            "at the joint, SD at 1 kHz [N·m]",
            {
                "harmonic": (0.0, 0.1, 0.4, 0.8, 1.5),
                "quasi_direct": (0.0, 0.05, 0.15, 0.3, 0.5),
                "harmonic.wrist": (0.0, 0.01, 0.04, 0.08, 0.15),
                "quasi_direct.wrist": (0.0, 0.01, 0.03, 0.06, 0.1),
                "passive": ABSENT,
            },
        ),
        "encoder": LevelRow(
            "bits per joint turn; offset, SD [°]",
            {"bits": (NONE, 19.0, 17.0, 15.0, 13.0), "offset_sd_deg": (0.0, 0.05, 0.15, 0.4, 1.0)},
        ),
        "delay": LevelRow("sensor and command together [ms]", {"value_ms": (0.0, 0.5, 1.5, 2.5, 4.0)}),
        "base_tilt": LevelRow(
            "of the base against gravity, SD about each horizontal axis [°]", {"sd_deg": (0.0, 0.1, 0.3, 0.7, 1.5)}
        ),
        "links": LevelRow(
            "mass and centre of the exoskeleton's links against its URDF, SD",
            {"mass": (0.0, 0.01, 0.03, 0.05, 0.1), "centre_mm": (0.0, 1.0, 3.0, 5.0, 10.0)},
        ),
        # Only machines with such sensors use this row.
        "cuff_sensors": LevelRow(
            "force/torque sensors at the cuffs, SD: gain; what taring leaves; noise at 1 kHz [N, N·m]",
            {
                "gain": (0.0, 0.005, 0.01, 0.015, 0.02),
                "force_bias": (0.0, 0.1, 0.33, 0.7, 1.3),
                "torque_bias": (0.0, 0.004, 0.012, 0.03, 0.053),
                "force_noise": (0.0, 0.05, 0.1, 0.2, 0.4),
                "torque_noise": (0.0, 0.002, 0.005, 0.01, 0.02),
            },
            source=(
                "level 2: ±0.5 % of 200 N and 7 N·m as three SD, level 4: ±2 %, by data sheets (develop.realman-"
                "robotics.com); gain and noise are assumed"
            ),
        ),
    }
)

ROWS: Mapping[str, LevelRow] = MappingProxyType({**WEARER, **MACHINE})


WORLDS: Mapping[WorldName, str] = MappingProxyType(
    {
        "home": "laws of the same form as the estimator's",
        "tissue": "other laws of the joints' elasticity, coupled joints, a rest posture that creeps, another time of "
        "the hysteresis",
        "shoulder": "another path of the shoulder's centre, which also depends on the plane of elevation, and lags",
        "cuffs": "cuffs that stiffen with strain, have another stiffness and slip along the limb; soft tissue that "
        "wobbles",
        "drives": "another law of friction, further ripple, a gain that depends on angle and temperature, hysteresis "
        "of the gears",
        "all": "all of these foreign laws at once",
        "unseen": "joints, shoulder and cuffs by other published laws than in `tissue`, `shoulder` and `cuffs`",
        "bodies": "home, with segments of another anthropometric sample",
    }
)
"""Worlds by name: the laws that act. A level changes sizes; a world changes laws."""


@dataclass(frozen=True)
class Disturbances:
    """Level of every row, where `None` switches a row off, and the world."""

    levels: Mapping[str, int | None]
    world: WorldName = "home"
    """World whose laws act, at any level."""

    @classmethod
    def at_level(cls, level: int, world: str = "home") -> "Disturbances":
        """Set every row to one level.

        Raises:
            ConfigError: The level or the world does not exist.
        """
        named: WorldName | None = next((one for one in WORLDS if one == world), None)
        if named is None:
            raise ConfigError(f"No world '{world}'. Worlds: {', '.join(WORLDS)}.")
        return cls(MappingProxyType(dict.fromkeys(ROWS, _checked(level))), named)

    def is_foreign(self, part: WorldName) -> bool:
        """Return True if the laws of this part are foreign ones: tissue, shoulder, cuffs or drives."""
        return self.world in (part, "all")

    def with_row(self, row: str, level: int) -> "Disturbances":
        """Return a copy with one row at another level."""
        return self._changed(row, _checked(level))

    def without(self, *rows: str) -> "Disturbances":
        """Return a copy with these rows switched off."""
        changed = self
        for row in rows:
            changed = changed._changed(row, None)
        return changed

    def value(self, row: str, column: str) -> Value:
        """Size of a row in a column."""
        return ROWS[row].value(column, self.levels[row])

    def _changed(self, row: str, level: int | None) -> "Disturbances":
        if row not in ROWS:
            near = difflib.get_close_matches(row, ROWS, n=1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise ConfigError(f"No disturbance '{row}'.{hint} Known: {', '.join(ROWS)}.")
        return replace(self, levels=MappingProxyType({**self.levels, row: level}))


def _checked(level: int) -> int:
    if level not in range(5):
        raise ConfigError(
            f"Disturbance level {level} does not exist; choose 0 (none) to 4 (a bad day). Level 2 is a good laboratory."
        )
    return level

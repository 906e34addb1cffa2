"""Stages of a rest for the participant, by phase."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from exograv.procedures.identification.rest_text import RestPhase

STAGES: Mapping[RestPhase, Literal["soon", "moves", "holds"]] = MappingProxyType(
    {
        RestPhase.WEIGHT: "soon",
        RestPhase.WAY: "moves",
        RestPhase.MOVES: "moves",
        RestPhase.BACK: "moves",
        RestPhase.LEARNS: "holds",
        RestPhase.FLOATS: "holds",
    }
)
"""Stage of each phase: before the motion, during it, or the arm is held."""

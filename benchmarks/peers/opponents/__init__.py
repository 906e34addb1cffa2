"""Implementations that take part; each module is one engine, imported only when a task is built."""

from peers.tasks.interface import Opponent

from .adam import AdamCasadi as AdamCasadi
from .adam import AdamJax as AdamJax
from .drake import Drake as Drake
from .frax import Frax as Frax
from .generated_c import GeneratedC as GeneratedC
from .generated_c_lanes import GeneratedCLanes as GeneratedCLanes
from .jax_by_hand import JaxAhead as JaxAhead
from .jax_by_hand import JaxByHand as JaxByHand
from .jax_translated import JaxTranslated as JaxTranslated
from .mujoco import Mujoco as Mujoco
from .native import Native as Native
from .pinocchio import Pinocchio as Pinocchio
from .virtual_machine import VirtualMachine as VirtualMachine

OPPONENTS: tuple[Opponent, ...] = (
    Native(),
    VirtualMachine(),
    GeneratedC(),
    GeneratedCLanes(),
    Pinocchio(),
    Mujoco(),
    JaxByHand(),
    JaxAhead(),
    JaxTranslated(),
    Frax(),
    AdamCasadi(),
    AdamJax(),
    Drake(),
)

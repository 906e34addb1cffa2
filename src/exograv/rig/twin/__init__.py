"""Embedded twin: a virtual machine and a virtual wearer, with a physics engine and true parameters of their own."""

from exograv.rig.twin.disturbances.levels import Disturbances as Disturbances
from exograv.rig.twin.foreign_arm.wearer_model import WearerModel as WearerModel
from exograv.rig.twin.foreign_arm.wearer_model import read_wearer_model as read_wearer_model
from exograv.rig.twin.machine.machine import Machine as Machine
from exograv.rig.twin.machine.machine import draw_machine as draw_machine
from exograv.rig.twin.wearer.donning import day_seed as day_seed
from exograv.rig.twin.wearer.donning import donned_again as donned_again
from exograv.rig.twin.wearer.parameter_truth import parameter_truth as parameter_truth
from exograv.rig.twin.wearer.segments import Body as Body
from exograv.rig.twin.wearer.wearer import Wearer as Wearer
from exograv.rig.twin.wearer.wearer import draw_wearer as draw_wearer

from .examiner import Examiner as Examiner
from .examiner import held_out_postures as held_out_postures
from .examiner import rms as rms
from .twin import Truth as Truth
from .twin import Twin as Twin
from .twin import TwinDivergedError as TwinDivergedError

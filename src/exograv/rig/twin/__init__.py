"""The embedded twin: a virtual machine with a virtual wearer, on another engine and with its own truth."""

from .donning import day_seed as day_seed
from .donning import donned_again as donned_again
from .examiner import Examiner as Examiner
from .examiner import held_out_postures as held_out_postures
from .examiner import rms as rms
from .levels import Disturbances as Disturbances
from .machine import Machine as Machine
from .machine import draw_machine as draw_machine
from .parameters import parameter_truth as parameter_truth
from .segments import Body as Body
from .twin import Truth as Truth
from .twin import Twin as Twin
from .wearer import Wearer as Wearer
from .wearer import draw_wearer as draw_wearer
from .wearer_model import WearerModel as WearerModel
from .wearer_model import read_wearer_model as read_wearer_model

from exograv.api.arm_in_machine import load_calibration as load_calibration
from exograv.api.compensator import Compensator as Compensator
from exograv.api.drives import Drives as Drives
from exograv.api.estimate import Estimate as Estimate
from exograv.api.estimate import identify as identify
from exograv.api.flight import Flight as Flight
from exograv.api.flight import float_arm as float_arm
from exograv.api.person import Person as Person
from exograv.api.pointing import PointingSession as PointingSession
from exograv.api.recording import Recording as Recording
from exograv.api.study import Study as Study
from exograv.api.twin import Twin as Twin
from exograv.errors import ExogravError as ExogravError
from exograv.model.description import load_rig as load_rig

__version__: str

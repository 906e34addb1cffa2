"""What the loop talks to: machines, real or virtual, behind one interface."""

from .interface import Rig as Rig

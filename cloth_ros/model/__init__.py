"""Mass-spring model of a cloth: forces, contact, time integration.  Imports nothing of ROS."""

from .cloth import Cloth, check_scene
from .energy import Energy
from .inputs import Inputs
from .snapshot import Snapshot

__all__ = ['Cloth', 'Energy', 'Inputs', 'Snapshot', 'check_scene']

"""Mass-spring model of a cloth: forces, contact, time integration.  Imports nothing of ROS."""

from .cloth import Cloth
from .energy import Energy
from .inputs import Inputs
from .scene_check import check_scene
from .snapshot import Snapshot

__all__ = ['Cloth', 'Energy', 'Inputs', 'Snapshot', 'check_scene']

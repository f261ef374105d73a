"""Mass-spring model of a cloth: forces, contact, time integration.  Imports nothing of ROS."""

from .cloth import Cloth
from .energy import Energy

__all__ = ['Cloth', 'Energy']

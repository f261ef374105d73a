"""
Integration methods, one per file.

A method is a class with a `name`, the `order` of its global error, and ``step(state, h)``, which
carries a `State` forward by one substep with the forces that a `Dynamics` gives it.  To add one,
write its file and name its class here.
"""

from .symplectic_euler import SymplecticEuler

METHODS = {method.name: method for method in (SymplecticEuler,)}

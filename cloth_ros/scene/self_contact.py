"""Parameters of the contact of the sheet with itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .parameter import ParameterGroup, parameter


@dataclass(frozen=True)
class SelfContactParameters(ParameterGroup):
    """Contact of the sheet with itself: layers keep a distance, and rub on each other."""

    prefix: ClassVar[str] = 'self_contact.'
    thickness: float = parameter(
        0.0,
        'distance of layers that lie on each other; 0: the sheet passes through itself',
        unit='m',
        low=0,
        high=10.0,
        fixed=True,
    )
    friction: float = parameter(
        0.3, 'coefficient of Coulomb friction between layers', low=0, high=10
    )

"""Parameters of the air: wind and gusts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from .conversion import unit_vector
from .parameter import ParameterGroup, invalid_value_error, parameter
from .quaternion import Vector
from .yaml_text import write


@dataclass(frozen=True)
class Gust(ParameterGroup):
    """A gust every period, of random speed in one direction."""

    prefix: ClassVar[str] = 'wind.gust.'
    period: float = parameter(
        0.0,
        'time from one gust to the next, the first after one period; 0: none',
        unit='s',
        low=0,
        high=1e6,
    )
    duration: float = parameter(1.0, 'how long a gust blows', unit='s', low=0, high=1e6)
    direction: Vector = parameter((0.0, 1.0, 0.0), 'where gusts blow to', low=-1e6, high=1e6)
    speed: tuple[float, float] = parameter(
        (0.0, 5.0), 'least and greatest speed, uniformly drawn', unit='m/s', low=0, high=1e4
    )
    seed: int = parameter(0, 'seed of the random speeds', low=0, high=2**53)

    def check(self) -> None:
        """Normalise the direction; check speed, period and duration."""
        unit = unit_vector('wind.gust.direction', self.direction, 'vector', (0.0, 1.0, 0.0))
        object.__setattr__(self, 'direction', unit)
        if self.speed[0] > self.speed[1]:
            swapped = write(self.speed[::-1])
            raise invalid_value_error(
                'wind.gust.speed', list(self.speed), 'least, then greatest', f'write {swapped}'
            )
        if 0 < self.period < 1e-3:
            raise invalid_value_error(
                'wind.gust.period', self.period, '0 or at least 0.001 s', 'write 0.001'
            )
        if 0 < self.period < self.duration:
            raise invalid_value_error(
                'wind.gust.duration',
                self.duration,
                f'at most wind.gust.period, {self.period:g} s',
                f'write {write(self.period)}, or lengthen the period',
            )


@dataclass(frozen=True)
class Wind(ParameterGroup):
    """Air: its velocity, density and drag coefficient."""

    prefix: ClassVar[str] = 'wind.'
    velocity: Vector = parameter(
        (0.0, 0.0, 0.0),
        'velocity of the air until a command comes',
        unit='m/s',
        low=-1e4,
        high=1e4,
    )
    air_density: float = parameter(
        1.2, 'density of the air; 0: no air', unit='kg/m³', low=0, high=1e4
    )
    drag_coefficient: float = parameter(
        1.0, 'drag coefficient of a triangle that faces the wind', low=0, high=100
    )
    gust: Gust = field(default_factory=Gust)

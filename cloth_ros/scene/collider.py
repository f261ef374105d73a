"""
Parameters of colliders: rigid bodies that move as commanded, unaffected by the cloth.

See `named_group` for how they are named and prepared.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .named_group import MAX_MEMBERS, NamedGroup, NamedMember
from .parameter import invalid_value_error, parameter
from .quaternion import Vector
from .yaml_text import write

MAX_COLLIDERS = MAX_MEMBERS
# Parameters of the shape that each type has; they must be given.
SHAPE_PARAMETERS: dict[str, tuple[str, ...]] = {
    'plane': (),
    'sphere': ('radius',),
    'box': ('size',),
    'capsule': ('radius', 'length'),
    'cylinder': ('radius', 'length'),
    'mesh': ('mesh',),
}
_LEAST, _GREATEST = 1e-4, 1e3  # m, of lengths


@dataclass(frozen=True)
class ColliderParameters(NamedMember):
    """
    Parameters of one collider.

    Attributes
    ----------
    type
        A key of `SHAPE_PARAMETERS`; empty while it is not given, which only a collider that is
        not in `collider.names` may be.
    size
        Lengths of the edges of a box, m.
    radius
        Of a sphere, capsule or cylinder, m.
    length
        Of a cylinder, or of the straight part of a capsule, along its z, m.
    mesh
        Path of a file.
    friction
        Coefficient of Coulomb friction.

    Shapes are centred at the origin; a plane is z = 0, with the free side at positive z.

    """

    group: ClassVar[str] = 'collider.'
    written: ClassVar[str] = 'type'
    type: str = parameter('', 'shape', choices=tuple(SHAPE_PARAMETERS))
    size: Vector = parameter(
        (0.0, 0.0, 0.0), 'edges of a box along its x, y, z', unit='m', low=0, high=_GREATEST
    )
    radius: float = parameter(
        0.0, 'radius of a sphere, capsule or cylinder', unit='m', low=0, high=_GREATEST
    )
    length: float = parameter(
        0.0,
        'height of a cylinder, or straight part of a capsule, along its z',
        unit='m',
        low=0,
        high=_GREATEST,
    )
    mesh: str = parameter('', 'path of an STL or OBJ file with a closed mesh')
    friction: float = parameter(0.3, 'coefficient of Coulomb friction', low=0, high=10)

    def check_complete(self) -> None:
        """Raise ValueError if something that the type needs is not given, or too small."""
        if not self.type:
            choices = ', '.join(repr(each) for each in SHAPE_PARAMETERS)
            raise ValueError(
                f'{self.full_name("type")} is not given, but must be one of {choices}; '
                f'write {write(next(iter(SHAPE_PARAMETERS)))}, and give it before or together '
                'with collider.names'
            )
        for field in SHAPE_PARAMETERS[self.type]:
            name, value = self.full_name(field), getattr(self, field)
            if isinstance(value, str):
                if not value.strip():
                    raise ValueError(
                        f'{name} is not given, but must be the path of an STL or OBJ file, for '
                        'a mesh; write "shape.stl", or the path of another file'
                    )
                continue
            lengths = value if isinstance(value, tuple) else (value,)
            if min(lengths) < _LEAST:
                usual = 0.1 if max(lengths) == 0 else _LEAST
                allowed = [max(each, usual) if each < _LEAST else each for each in lengths]
                raise invalid_value_error(
                    name,
                    list(value) if isinstance(value, tuple) else value,
                    f'{_LEAST:g} to {_GREATEST:g} m, for a {self.type}',
                    f'write {write(allowed if isinstance(value, tuple) else allowed[0])}',
                )

    @property
    def unused(self) -> tuple[str, ...]:
        """Names of parameters that are given and have no effect on a collider of this type."""
        used = SHAPE_PARAMETERS.get(self.type, ())
        fields = dict.fromkeys(each for some in SHAPE_PARAMETERS.values() for each in some)
        given = (
            field for field in fields if getattr(self, field) not in ('', 0.0, (0.0, 0.0, 0.0))
        )
        return tuple(self.full_name(field) for field in given if field not in used)


@dataclass(frozen=True)
class Colliders(NamedGroup[ColliderParameters]):
    """The colliders of a scene besides the sphere, and parameters of others not added yet."""

    prefix: ClassVar[str] = 'collider.'
    member: ClassVar[type[NamedMember]] = ColliderParameters
    names: tuple[str, ...] = parameter((), 'names of colliders, besides the sphere')

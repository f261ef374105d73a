"""Which scenes self-contact can be simulated in."""

from __future__ import annotations

from ...scene import Scene
from ...scene.parameter import invalid_value_error
from .intersections import least_thickness

# Greatest thickness, in spacings: beyond it, neighbours in the flat sheet would touch.
_MOST = 0.4


def check(scene: Scene, resolution: float) -> None:
    """
    Refuse a thickness that the grid or the precision cannot represent.

    Parameters
    ----------
    scene
        Parameters.
    resolution
        Of the precision: the relative difference of two numbers.

    Raises
    ------
    ValueError
        Names the parameter, its value, the allowed range and a remedy.

    """
    name, thickness, sheet = 'self_contact.thickness', scene.self_contact.thickness, scene.sheet
    if thickness == 0:
        return
    if min(sheet.rows, sheet.columns) < 2:
        allowed = '0 for a sheet with a single row or column'
        raise invalid_value_error(name, thickness, allowed, f'write {name}: 0.0')
    most = _MOST * sheet.shortest_spacing
    least = least_thickness(sheet.diagonal, resolution)
    if thickness > most:
        raise invalid_value_error(
            name,
            thickness,
            f'at most {_MOST:g} of the spacing of the particles, {most:.3g} m',
            f'write {_rounded(0.9 * most)}, or lower sheet.rows and sheet.columns',
        )
    if thickness < least:
        raise invalid_value_error(
            name,
            thickness,
            f'0 or at least {least:.3g} m, which this precision resolves',
            f'write {_rounded(1.1 * least)}, or solver.precision: double',
        )
    if scene.solver.overload == 'coarsen':
        raise invalid_value_error(
            'solver.overload',
            'coarsen',
            'slow_motion with self_contact.thickness above 0: between the particles of another '
            'grid a folded sheet may pass through itself',
            'write solver.overload: slow_motion',
        )


def _rounded(value: float) -> str:
    return f'{value:.2g}'

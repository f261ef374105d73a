"""Values of the diagnostics about contact."""

from __future__ import annotations

from collections.abc import Mapping

from ..model.contact.collider import Collider


def contact_values(colliders: Mapping[str, Collider]) -> dict[str, object]:
    """Return depth and number of touching particles of each collider, by name and unit."""
    values: dict[str, object] = {}
    for name, collider in colliders.items():
        values[f'{name} penetration [m]'] = collider.max_penetration
        values[f'{name} touching particles'] = collider.touching
    return values

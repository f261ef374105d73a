"""What a live cloth reports about itself: how it has run, and values of contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..model import Cloth
from ..model.contact.collider import Collider
from ..model.energy_monitor import RollbackCounts
from ..model.self_contact.self_contact import SelfContact
from ..model.time_step import integrator_for


@dataclass(frozen=True)
class Report:
    """
    How a cloth has run since the last report.

    Attributes
    ----------
    real_time_factor
        Simulated time by time passed.
    lost
        Time given up, s; 0 if it is too little to notice.
    cause
        Why it was given up; empty if none was.
    waiting
        Time for which the process did not get the processor while it simulated, s.
    rollbacks
        Batches of substeps that were rolled back.
    held
        Why the cloth is held; empty if it is not.
    reduction
        What is given up because of overload, in words; empty if nothing is.

    """

    real_time_factor: float
    lost: float
    cause: str
    waiting: float
    rollbacks: RollbackCounts
    held: str
    reduction: str


def contact_values(colliders: Mapping[str, Collider]) -> dict[str, object]:
    """Return depth and number of touching particles of each collider, by name and unit."""
    values: dict[str, object] = {}
    for name, collider in colliders.items():
        values[f'{name} penetration [m]'] = collider.max_penetration
        values[f'{name} touching particles'] = collider.touching
    return values


def self_contact_values(self_contact: SelfContact | None) -> dict[str, object]:
    """Return values of the contact of the sheet with itself; empty: the scene has none."""
    if self_contact is None:
        return {}
    return {
        'self-contact pairs': self_contact.contacts,
        'self-contact distance [m]': self_contact.distance,
        'self-contact shortened paths': self_contact.shortened,
    }


def measured_values(cloth: Cloth, load: float, error: Mapping[str, object]) -> dict[str, object]:
    """
    Return measured values by name and unit; takes as long as some substeps.

    Parameters
    ----------
    cloth
        What is simulated.
    load
        Wall-clock time by simulated time.
    error
        Values of the error estimate.

    """
    strain = cloth.strain()
    return {
        'simulated time [s]': cloth.time,
        'substeps in the last tick': cloth.substeps,
        'method': integrator_for(cloth.scene).name,
        'tolerance [m]': cloth.scene.solver.tolerance,
        'substep [s]': cloth.substep,
        'stability limit [s]': cloth.stability_limit,
        'load [share of real time]': load,
        'energy [J]': cloth.energy(),
        'largest stretch': strain.stretch,
        'largest shear angle [rad]': strain.shear_angle,
        'largest fold angle [rad]': strain.fold_angle,
        **error,
        'sphere radius [m]': cloth.sphere_radius,
        'sphere penetration [m]': cloth.sphere_depth,
        **contact_values(cloth.colliders),
        **{f'{name} held particles': len(each.held) for name, each in cloth.grippers.items()},
        **self_contact_values(cloth.self_contact),
        **{f'substep batches {how}': count for how, count in vars(cloth.rollbacks).items()},
    }

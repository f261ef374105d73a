"""One line of text about the solver of a cloth: substeps, integrator, precision, cost."""

from __future__ import annotations

from ..model import Cloth
from ..model.precision import precision_for, reason_for_double
from ..model.time_step import integrator_for


def solver_summary(cloth: Cloth, load: float) -> str:
    """Describe how a cloth is simulated, and which share of real time that takes."""
    scene = cloth.scene
    reason = reason_for_double(scene)
    precision = precision_for(scene) + ' precision' + (f' ({reason})' if reason else '')
    return (
        f'{1 / (scene.rate * cloth.substep):.0f} substeps of {1e3 * cloth.substep:.3g} ms of '
        f'{integrator_for(scene).name} in {precision}, for a tolerance of '
        f'{1e3 * scene.solver.tolerance:.3g} mm; stability limit '
        f'{1e3 * cloth.stability_limit:.3g} ms, cost without contact {100 * load:.2g} % of '
        'real time'
    )

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene, Springs
from cloth_ros.model import stability
from cloth_ros.model.forces.springs import spring_ends, spring_families
from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.model.integrators.integrator import SubstepBatch

every_method = pytest.mark.parametrize('method', INTEGRATORS)


def laplacian(scene: Scene) -> np.ndarray:
    """The graph Laplacian of a scene with its stiffness as weights, N/m, dense."""
    rows, columns = scene.sheet.rows, scene.sheet.columns
    index = np.arange(rows * columns).reshape(rows, columns)
    matrix = np.zeros((index.size, index.size))
    for family in spring_families(scene):
        for i, j in zip(*(end.ravel() for end in spring_ends(family, index)), strict=True):
            matrix[i, i] += family.stiffness
            matrix[j, j] += family.stiffness
            matrix[i, j] -= family.stiffness
            matrix[j, i] -= family.stiffness
    return matrix


@settings(max_examples=60, deadline=None)
@given(
    rows=st.integers(1, 24),
    columns=st.integers(1, 24),
    stiffness=st.tuples(*[st.sampled_from([0.0, 1.0, 30.0, 500.0])] * 3),
)
def test_the_eigenvalue_is_bounded_and_not_by_much(rows, columns, stiffness):
    scene = Scene(sheet={'rows': rows, 'columns': columns}, pins=[''], springs=Springs(*stiffness))
    exact = np.linalg.eigvalsh(laplacian(scene))[-1]
    found = stability.largest_eigenvalue(rows, columns, stiffness)
    # Below by less than what the safety factor of the step leaves.
    assert exact * stability.SAFETY <= found <= 1.06 * exact + 1e-9
    assert exact <= stability.gershgorin_bound(rows, columns, stiffness) + 1e-9


def undamped(**changes: object) -> Scene:
    return Scene().with_parameters(
        {
            'sheet.rows': 12,
            'sheet.columns': 12,
            'pins': ['0,:'],
            'drag': 0.0,
            'wind.air_density': 0.0,
            'gravity': [0, 0, 0],
            'solver.precision': 'double',
            **changes,
        }
    )


def growth(scene: Scene, stretch: float, factor: float, noise: float = 1e-9) -> float:
    """
    Run 1000 substeps of `factor` times the limit from near an equilibrium.

    The sheet is stretched and held all around.  Returns by what the deviation from equilibrium
    has grown.
    """
    # Without bending springs, which end at the border and would pull there from one side.
    held = {'pins': ['0,:', '-1,:', ':,0', ':,-1'], 'springs.bending': 0.0}
    cloth = Cloth(scene.with_parameters(held))
    equilibrium = cloth.positions * (stretch, stretch, 1)
    shifts = np.random.default_rng(2).normal(0, noise, equilibrium.shape)
    cloth.positions = equilibrium + shifts * ~cloth.scene.pinned()[..., None]
    blocks = [SubstepBatch(10, factor * cloth.stability_limit)] * 100
    for _ in cloth._method.run(cloth._state, blocks, cloth._moved, cloth._watched):
        pass
    return float(np.abs(cloth.positions - equilibrium).max() / np.abs(shifts).max())


@every_method
@pytest.mark.parametrize('stretch', [1.0, 1.5, 30.0])
@pytest.mark.parametrize('damping', [0.0, 0.02])
def test_the_step_taken_is_stable(stretch, damping, method):
    scene = undamped(**{'springs.damping': damping, 'solver.method': method})
    # Flat the sheet is soft across its plane, so that the noise drifts as it may.
    assert growth(scene, stretch, stability.SAFETY) < (1e4 if stretch == 1 else 30)


@every_method
@pytest.mark.parametrize('damping', [0.0, 0.02])
def test_the_limit_is_close_to_where_it_does_blow_up(damping, method):
    """Far stretched, springs are stiff in every direction, and the bound is nearly reached."""
    scene = undamped(**{'springs.damping': damping, 'solver.method': method})
    assert growth(scene, 30.0, 1.1) > 1e6


@every_method
@pytest.mark.parametrize(('stretch', 'crumple'), [(3.0, 1e-3), (0.6, 0.05), (1.0, 0.1)])
def test_violent_motion_does_not_gain_energy(stretch, crumple, method):
    """Explicit methods at 0.9 of the limit heat these a hundredfold."""
    cloth = Cloth(undamped(**{'solver.method': method}))
    generator = np.random.default_rng(2)
    p = cloth.positions * (stretch, stretch, 1)
    cloth.positions = p + generator.normal(0, crumple, p.shape)
    start = cloth.energy()
    for _ in range(5 * 60):
        cloth.advance(1 / 60)
    assert 0.7 * start < cloth.energy() < 1.3 * start


@every_method
@settings(deadline=None)
@given(elastic=st.floats(1e-6, 1e12), viscous=st.one_of(st.just(0.0), st.floats(1e-6, 1e6)))
def test_the_limit_of_a_method_is_that_of_its_amplification(elastic, viscous, method):
    """No oscillator up to these grows in a step just below it, and one does just above."""
    kind = INTEGRATORS[method]
    limit = kind.stable_step(elastic, viscous)

    def greatest(factor: float) -> float:
        shares = np.linspace(0, 1, 6)
        steps = [
            kind.amplification(factor * limit, a * elastic, b * viscous)
            for a in shares
            for b in shares
        ]
        return float(np.abs(np.linalg.eigvals(np.stack(steps))).max())

    # A step of two equal eigenvalues has them only to the square root of rounding.
    assert greatest(0.999) <= 1 + 1e-6
    assert greatest(1.01) > 1 + 1e-6


def test_without_springs_there_is_no_limit():
    scene = undamped(**{'springs.structural': 0, 'springs.shear': 0, 'springs.bending': 0})
    assert scene.stability_limit() == math.inf


def test_pins_do_not_shorten_the_step():
    assert undamped(pins=['']).stability_limit() == undamped(pins=[':,0']).stability_limit()

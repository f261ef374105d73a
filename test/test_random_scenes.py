"""Random scenes keep every promise; `make torture` runs ten thousand."""

import numpy as np
import pytest
from hypothesis.errors import FlakyFailure

from cloth_ros import Cloth, Scene
from reliability import promises, torture
from reliability.plain import PlainCloth
from reliability.promises import BrokenPromiseError, Counted, Outcome, Watch, run
from reliability.scenes import Input, Trial, least_substeps
from reliability.torture import explodes

TRIALS = 300

SQUARE = {'sheet.rows': 17, 'sheet.columns': 17, 'gravity': [0.0, 0.0, 0.0], 'drag': 0.0}
DENSE = {'wind.air_density': 1e3, 'springs.structural': 1e5, 'springs.shear': 1e7}


def trial(parameters: dict, start: str, size: float, *inputs: Input) -> Trial:
    return Trial(tuple(sorted(parameters.items())), start, size, 0, inputs)


STRETCHED = {
    'rate': 1.0,
    'drag': 0.0,
    'gravity': [0.0, 0.0, 0.0],
    'sheet.rows': 4,
    'sheet.columns': 2,
    'sheet.mass': 8.0,
    'sheet.size': [0.01, 0.001],
    'springs.structural': 1.0,
    'springs.shear': 0.0,
    'springs.bending': 0.0,
    'sphere.radius': 10**-3.5,
    'sphere.position': [0.0, 0.0, 1.0],
    'sphere.friction': 0.0,
}

# Each of these broke a promise once.
BROKEN_ONCE = {
    'energy grew fivefold in the first block of substeps': trial(
        {**SQUARE, 'springs.structural': 5e4, 'wind.air_density': 0.0}, 'crumpled', 0.1, Input(0.1)
    ),
    'air at rest did work on a sheet that turned over within a substep': trial(
        {'sheet.rows': 5, 'sheet.columns': 14, 'springs.damping': 17.8, 'sheet.mass': 3.0},
        'inverted',
        2.0,
        Input(0.3),
    ),
    'a storm drove a sheet through a sphere at 9000 radii a second, and left it in there': trial(
        {
            **dict.fromkeys(('drag', 'sphere.friction'), 0.0),
            **{f'springs.{family}': 0.0 for family in ('shear', 'bending', 'damping')},
            'springs.structural': 1.0,
            'gravity': [0.0, 0.0, 0.0],
            'pins': [''],
            'rate': 1.0,
            'sheet.rows': 3,
            'sheet.columns': 2,
            'sheet.mass': 6.0,
            'sheet.size': [1.0, 1.0],
            'solver.precision': 'single',
            'sphere.radius': 1.0,
            'sphere.position': [0.0, 0.0, 1.0],
            'wind.air_density': 1.2,
        },
        'crumpled',
        10.0,
        Input(1.0),
        Input(1.0, wind=(0.0, 0.0, -5.0)),
        Input(1.0, wind=(1e4, 0.0, 0.0)),
        Input(1.0),
    ),
    'a free narrow sheet drifted, as the ends of its springs were rounded unlike': trial(
        {
            **SQUARE,
            'sheet.rows': 2,
            'sheet.columns': 11,
            'sheet.size': [2.2, 2.4],
            'springs.structural': 1.2e6,
            'pins': [''],
            'wind.air_density': 0.0,
        },
        'flat',
        0.1,
        *[Input(0.02)] * 6,
    ),
    'a sphere that appeared between layers of the sheet never pushed all of them out': trial(
        {**SQUARE, 'sphere.radius': 10.0, 'sphere.position': [0.0, 0.0, 1.0]},
        'inverted',
        1.0,
        Input(1.0, sphere=(0.0, 0.0, 0.0)),
    ),
    'a particle in the middle of the sphere was said not to be in it': trial(
        {**SQUARE, 'sphere.radius': 0.2, 'sphere.position': [0.0, 0.0, 1.0], 'pins': [':,:']},
        'flat',
        0.1,
        Input(0.1),
    ),
    'a sphere that lifted a particle within a single substep was left standing in it': trial(
        {
            'sheet.rows': 1,
            'sheet.columns': 1,
            'rate': 1.0,
            'drag': 1e3,
            'gravity': [0.0, 981.0, 0.0],
            'pins': [''],
            'sphere.radius': 1.0,
            'sphere.position': [0.0, 6.0, 1.0],
        },
        'flat',
        0.1,
        Input(1.0, sphere=(0.0, 0.0, 0.0)),
    ),
    'a sphere grew in a sheet that was too fast to get out of its way': trial(
        {
            'sheet.rows': 2,
            'sheet.columns': 2,
            'sheet.mass': 4.0,
            'rate': 1.0,
            'drag': 0.0,
            'gravity': [0.0, 5000.0, 0.0],
            'pins': [''],
            'springs.structural': 10.0,
            'springs.shear': 0.0,
            'springs.bending': 0.0,
            'sphere.radius': 1.0,
            'sphere.position': [0.0, 0.0, 1.0],
        },
        'crumpled',
        1.0,
        Input(1.0, change=(('sheet.mass', 3.1622776601683795),)),
    ),
    'a sweep that was given up took pins along, and said too little how deep': trial(
        STRETCHED,
        'flat',
        1.0,
        Input(1.0),
        Input(1.0, reset=True),
        Input(1.0, sphere=(0.0, 0.0, -3.0), reset=True),
        Input(1.0, wind=(0.0, 0.0, -1e4), sphere=(0.0, 0.0, 0.0)),
    ),
    'a sheet in dense air in a storm was held for good': trial(
        {**DENSE, 'sheet.rows': 3, 'sheet.columns': 3, 'sheet.mass': 9.0},
        'inverted',
        0.9,
        Input(0.04, wind=(0.0, 1e4, 0.0)),
        Input(0.04, wind=(0.0, -1e4, 0.0)),
    ),
}


@pytest.mark.parametrize('case', BROKEN_ONCE.values(), ids=BROKEN_ONCE)
def test_what_failed_once_does_not_again(case):
    outcome = Outcome()
    run(case, outcome, patience=60.0)
    assert outcome.trials == 1
    assert outcome.rollbacks['held'] == 0


def test_random_scenes_keep_every_promise():
    outcome, _ = torture.torture(TRIALS, number=0, some_springs=False)
    assert outcome.trials + outcome.cut >= TRIALS
    assert outcome.trials > 0.9 * TRIALS
    assert outcome.given > 0
    assert 0 < outcome.found < outcome.advances


def test_a_trial_that_is_cut_is_checked_where_it_is(monkeypatch):
    crumpled = trial(SQUARE, 'crumpled', 0.1, Input(1.0))
    outcome = Outcome()
    run(crumpled, outcome, patience=0.0)
    assert (outcome.trials, outcome.cut, outcome.advances) == (0, 1, 1)

    class Left(Counted):
        """A cloth that is no good where it is left."""

        def advance_stepwise(self, seconds):
            self._state.velocity[...] = np.nan
            yield

    monkeypatch.setattr(promises, 'Counted', Left)
    with pytest.raises(BrokenPromiseError, match='not finite'):
        run(crumpled, outcome, patience=0.0)


def test_work_that_is_taken_as_it_is_found_is_said():
    outcome = Outcome()
    grows = 'a sphere grew in a sheet that was too fast to get out of its way'
    run(BROKEN_ONCE[grows], outcome, patience=60.0)
    assert (outcome.found, outcome.energy) == (outcome.advances, 0.0)
    run(trial(SQUARE, 'crumpled', 0.1, Input(0.1)), outcome, patience=60.0)
    assert outcome.found == outcome.advances - 1


@pytest.mark.parametrize(
    'error',
    [ValueError('unforeseen'), FlakyFailure('comes and goes', [BrokenPromiseError('energy')])],
    ids=lambda error: type(error).__name__,
)
def test_whatever_ends_the_trials_is_a_promise_not_kept(error, monkeypatch, tmp_path):
    def fail(*_):
        raise error

    monkeypatch.setattr('reliability.record.RESULTS', tmp_path)
    monkeypatch.setattr(torture, 'shared', fail)
    monkeypatch.setattr('sys.argv', ['torture'])
    assert torture.main() == 1
    (written,) = tmp_path.iterdir()
    assert '"kept": false' in written.read_text()


def watched(**more: object) -> tuple[Cloth, Watch]:
    scene = {'sphere.radius': 0.2, 'sphere.position': [0.0, 0.0, 2.0], 'wind.air_density': 0.0}
    scene |= {name.replace('__', '.'): value for name, value in more.items()}
    cloth = trial(scene, 'flat', 0.0).cloth()
    return cloth, Watch(cloth, Outcome())


def test_a_state_that_is_not_finite_is_noticed():
    cloth, watch = watched()
    cloth._state.velocity[0, cloth._grid_layout.begin + 40] = np.nan
    with pytest.raises(BrokenPromiseError, match='not finite'):
        watch.check()


def test_energy_from_nowhere_is_noticed():
    cloth, watch = watched()
    cloth.velocities = np.ones((32, 32, 3))
    with pytest.raises(BrokenPromiseError, match='from nowhere'):
        watch.check()


def test_more_energy_than_the_longest_step_explains_is_noticed():
    cloth, watch = watched(solver__substeps=least_substeps(Scene()))
    cloth.velocities = np.ones((32, 32, 3))
    watch.check()
    cloth.velocities = np.full((32, 32, 3), 100.0)
    with pytest.raises(BrokenPromiseError, match='from nowhere'):
        watch.check()


def test_springs_that_a_fall_stretches_are_noticed():
    vacuum = {'pins': [''], 'wind.air_density': 0.0, 'solver.precision': 'double'}
    cloth = trial(vacuum, 'flat', 0.0).cloth()
    watch = Watch(cloth, Outcome())
    cloth.advance(1.0)
    watch.check()
    # What the fall has given, in another form: the total is as before.
    falling = cloth.velocities.copy()
    falling[::2] *= -1
    cloth.velocities = falling
    with pytest.raises(BrokenPromiseError, match='a fall in springs'):
        watch.check()


def test_a_pin_that_moves_is_noticed():
    cloth, watch = watched()
    moved = cloth.positions.copy()
    moved[0, 0] += 1e-6
    cloth.positions = moved
    with pytest.raises(BrokenPromiseError, match='a pin has moved'):
        watch.check()


def test_a_triangle_in_the_sphere_is_noticed():
    cloth, watch = watched()
    # Set from outside, it would find the sphere smaller.
    cloth._grid_layout.grid(cloth._state.position)[2, 10:20, 10:20] += 0.9
    watch.begin()
    with pytest.raises(BrokenPromiseError, match='deep in the sphere'):
        watch.check()


def test_the_plain_simulation_is_one_that_works_where_its_step_allows():
    calm = trial({'wind.air_density': 0.0, 'sheet.rows': 8, 'sheet.columns': 8}, 'flat', 0.0)
    cloth = calm.cloth()
    plain = PlainCloth(cloth, 200)
    for _ in range(12):
        plain.advance(1 / 60, np.array(cloth.sphere_position))
        cloth.advance(1 / 60)
    np.testing.assert_allclose(np.moveaxis(plain.positions, 0, -1), cloth.positions, atol=2e-3)
    once = trial(dict(calm.parameters), 'flat', 0.0, Input(1.0))
    assert not explodes(once, 200)
    assert explodes(
        trial({**dict(calm.parameters), 'springs.structural': 1e6}, 'flat', 0.0, Input(1.0)), 1
    )

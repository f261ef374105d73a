"""Advice for scenes that are too slow: each remedy is followed, at a given cost of a substep."""

import re

import pytest
import yaml
from builders import examples, only, scene_of
from hypothesis import assume, given
from hypothesis import strategies as st

from cloth_ros import Scene
from cloth_ros.live.overload import OVERLOADED, Overload
from cloth_ros.live.real_time_advice import advice
from cloth_ros.model.time_step import check_time_step, usual_substep


def remedies(text: str) -> list[dict[str, object]]:
    """Return the changes that an advice proposes, read as a parameter file is."""
    _, found, choices = text.partition(' makes it real time')
    if not found:
        assert text.endswith('no single parameter can change that enough')
        return []
    _, _, choices = choices.partition(': ')
    return [
        {name: yaml.safe_load(value) for name, value in re.findall(r'([a-z.]+): ([^,\s]+)', each)}
        for each in choices.split(' | ')
    ]


def particles(scene: Scene) -> int:
    return scene.sheet.rows * scene.sheet.columns


def load_after(scene: Scene, cost: float, changes: dict[str, object]) -> float:
    """Return the load once changes are made; the cost of a substep is that of its particles."""
    changed = scene.with_parameters(changes)
    check_time_step(changed)
    if 'solver.overload' in changes:
        overload = Overload(changed)
        assert overload.relax(cost)
        level = overload.level
        return cost * level.particles / particles(scene) / level.substep
    of_particles = cost * particles(changed) / particles(scene)
    # A few particles cost as much as the call of the kernel.
    return max(of_particles, min(cost, 5e-6)) / usual_substep(changed)


exponents = st.floats(0.0, 8.0).map(lambda exponent: 10.0**exponent)


@examples(0.15)
@given(
    rows=st.sampled_from([1, 3, 9, 24, 64, 128]),
    columns=st.sampled_from([2, 3, 40, 64, 128]),
    stiffness=st.tuples(*[exponents | st.just(0.0)] * 3),
    damping=st.sampled_from([0.0, 0.0, 1e-3, 1.0, 1e3]),
    mass=st.sampled_from([1e-3, 0.2, 50.0]),
    tolerance=st.sampled_from([1e-6, 1e-3, 0.1]),
    rate=st.sampled_from([1.0, 60.0, 1000.0]),
    fixed=st.sampled_from([0, 0, 0, 4]),
    overload=st.sampled_from(['slow_motion', 'coarsen']),
    cost=st.floats(-5.5, -1.0).map(lambda exponent: 10.0**exponent),
)
def test_a_scene_that_follows_a_remedy_is_real_time_and_changes_no_more_than_it_must(
    rows, columns, stiffness, damping, mass, tolerance, rate, fixed, overload, cost
):
    scene = scene_of(
        **{'sheet__rows': rows, 'sheet__columns': columns, 'sheet__mass': mass, 'rate': rate},
        **dict(zip(only(None), stiffness, strict=True)),
        **{'springs__damping': damping, 'solver__tolerance': tolerance, 'pins': ['']},
        solver__overload=overload,
    )
    try:
        check_time_step(scene)
        # Some times as many substeps as are stable.
        many = round(fixed / (rate * usual_substep(scene)))
        scene = scene.with_parameters({'solver.substeps': min(many, 1_000_000)})
        check_time_step(scene)
    except ValueError:
        assume(False)
    load = cost / usual_substep(scene)
    assume(load > OVERLOADED)
    text = advice(scene, cost)
    assert f'{100 * load:.0f} % of real time' in text
    assert '\n' not in text
    for changes in remedies(text):
        found = load_after(scene, cost, changes)
        assert found <= 0.66, (text, changes)
        name, value = next(iter(changes.items()))
        if name == 'sheet.mass' or name == 'solver.tolerance':
            before = scene.flat()[name]
            less = {name: max(before, value / 1.2)}
            assert load_after(scene, cost, less) > 0.64, (text, changes)
        # Not of a few particles: the limit then depends on each row of them.
        if name == 'sheet.rows' and min(changes.values()) > 10:
            finer = {each: min(count + 1, scene.flat()[each]) for each, count in changes.items()}
            assert finer == changes or load_after(scene, cost, finer) > 0.55, (text, changes)


STIFF = scene_of(springs__structural=5e7)


@pytest.mark.parametrize(
    ('changes', 'cost', 'why', 'names'),
    [
        (
            {},
            2e-5,
            'springs.structural is 5e+07 N/m at a mass of 0.2 kg on 32 × 32 particles',
            {'springs.structural', 'sheet.mass', 'sheet.rows', 'solver.overload'},
        ),
        (
            {'solver.overload': 'coarsen'},
            2e-5,
            'springs.structural is 5e+07 N/m',
            {'springs.structural', 'sheet.mass', 'sheet.rows'},
        ),
        (
            {'springs.structural': 500.0, 'springs.bending': 1e6},
            2e-5,
            'springs.bending is 1e+06 N/m',
            {'springs.bending', 'sheet.mass', 'sheet.rows', 'solver.overload'},
        ),
        (
            {'springs.structural': 500.0, 'springs.damping': 500.0},
            2e-5,
            'springs.damping is 500 N·s/m at a mass of 0.2 kg',
            {'springs.damping', 'sheet.mass', 'sheet.rows', 'solver.overload'},
        ),
        (
            {'springs.structural': 500.0, 'solver.tolerance': 1e-6},
            1e-4,
            'solver.tolerance is 1e-06 m',
            {
                'solver.tolerance',
                'springs.structural',
                'sheet.mass',
                'sheet.rows',
                'solver.overload',
            },
        ),
        (
            {'springs.structural': 500.0, 'solver.substeps': 5000},
            2e-5,
            'solver.substeps is 5000',
            {'solver.substeps', 'solver.overload'},
        ),
        (
            {f'springs.{name}': 0.0 for name in ('structural', 'shear', 'bending')}
            | {'rate': 1000.0},
            1e-3,
            'rate is 1000 Hz',
            {'rate', 'sheet.rows', 'solver.overload'},
        ),
    ],
)
def test_the_cause_is_named_with_all_remedies_that_there_are(changes, cost, why, names):
    text = advice(STIFF.with_parameters(changes), cost)
    assert f', because {why}' in text
    assert {next(iter(changes)) for changes in remedies(text)} == names, text

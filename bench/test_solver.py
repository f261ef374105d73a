"""Cost of a substep: by size, precision and threads, and by effect."""

from __future__ import annotations

import os

import pytest

from cloth_ros import Cloth

from .sheets import SIZES, scene, time_substeps

THREADS = [1, 2] if (os.cpu_count() or 1) > 1 else [1]


@pytest.mark.parametrize('threads', THREADS)
@pytest.mark.parametrize('precision', ['single', 'double'])
@pytest.mark.parametrize('size', SIZES)
def test_size(benchmark, size, precision, threads):
    """Springs of all families and gravity."""
    changes = {'solver.precision': precision, 'solver.threads': threads}
    cloth = Cloth(scene(size).with_parameters(changes))
    time_substeps(benchmark, cloth, table='size', size=size, precision=precision, threads=threads)


EFFECTS = {
    'structural springs alone': {'springs__shear': 0.0, 'springs__bending': 0.0},
    'all springs and gravity': {},
    'with drag': {'drag': 0.5},
    'with dashpots of 1e-5 N·s/m': {'springs__damping': 1e-5},
    'with dashpots of 1e-3 N·s/m': {'springs__damping': 1e-3},
    'with a row of pins': {'pins': ['0,:']},
    'with still air': {'wind__air_density': 1.2},
    'with wind and gusts': {
        'wind__air_density': 1.2,
        'wind__velocity': [0.0, 2.0, 1.0],
        'wind__gust__period': 1.0,
    },
    'with a sphere far away': {'sphere__radius': 0.1, 'sphere__position': [0.0, 0.0, -50.0]},
    'with drag, air and a sphere far away': {
        'drag': 0.5,
        'wind__air_density': 1.2,
        'sphere__radius': 0.1,
        'sphere__position': [0.0, 0.0, -50.0],
    },
}


@pytest.mark.parametrize('effect', EFFECTS)
def test_effect(benchmark, effect):
    """A scene with one effect more or less, 128 × 128, single precision, one thread."""
    time_substeps(benchmark, Cloth(scene(128, **EFFECTS[effect])), table='effect', effect=effect)

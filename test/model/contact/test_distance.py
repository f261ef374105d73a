"""Distances from shapes and the normals of their offset surfaces."""

import math

import numpy as np
import pytest
from builders import examples, seeds
from colliders import SHAPES, solid
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.contact.distance import distance_from as subroutine
from cloth_ros.model.contact.mesh_fields import MeshFields
from cloth_ros.model.contact.rigid_collider import RigidCollider
from cloth_ros.model.kernels.jit import exact
from cloth_ros.scene.collider import ColliderParameters

RHO = 0.01  # circumradius of triangles, m
SIZE = 0.15  # of the colliders, m
STEP = 1e-7  # of differences, m


@exact
def distance_from(kind, row, fields, x, y, z, rho):
    """Call the subroutine, which has no interface to Python."""
    return subroutine(kind, row, fields, x, y, z, rho)


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('meshes')


@pytest.mark.parametrize('shape', SHAPES)
@examples(1)
@given(seed=seeds, rho=st.sampled_from([0.0, 0.5 * RHO, RHO]))
def test_the_normal_is_the_gradient_of_the_distance(folder, shape, seed, rho):
    """Beside edges too, where the offset makes a ramp; not on the lines at which it has a bend."""
    generator, body = np.random.default_rng(seed), solid(shape, SIZE, folder)
    collider = RigidCollider(
        ColliderParameters(name='solid', **body.parameters), RHO, 1.0, np.float64
    )
    row = collider.rows(np.zeros(3), np.zeros(2))[0]
    fields = MeshFields([collider], np.float64).of(collider)

    def measured(point):
        return np.array(distance_from(collider.kind, row, fields, *(point - row[9:12]), rho))

    points = generator.uniform(-1.5 * SIZE, 1.5 * SIZE, (4000, 3))
    near = points[np.abs(body.distance(points)) < RHO][:50]
    agree = []
    for point in near:
        steps = STEP * np.eye(3)
        gradient = [measured(point + each)[0] - measured(point - each)[0] for each in steps]
        along = np.array(gradient) / np.linalg.norm(gradient) @ measured(point)[1:]
        agree.append(math.isclose(along, 1, abs_tol=1e-4))
    assert len(near) > 20
    assert np.mean(agree) > 0.9

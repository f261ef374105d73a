"""The deepest point of a triangle, compared with a search that divides the triangle."""

import numpy as np
import pytest
from builders import examples, seeds
from colliders import CLOSED, deepest, solid
from hypothesis import given
from hypothesis import strategies as st

from cloth_ros.model.contact import deepest_point as subroutines
from cloth_ros.model.contact.mesh_fields import MeshFields
from cloth_ros.model.contact.rigid_collider import RigidCollider
from cloth_ros.model.kernels.jit import exact
from cloth_ros.scene.collider import ColliderParameters

subroutine = subroutines.deepest_point


@exact
def deepest_point(points, shape, reach, tolerance):
    """Call the subroutine, which has no interface to Python."""
    return subroutine(points, 0, 1, 2, shape, reach, tolerance)


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('meshes')


@pytest.mark.parametrize('shape', [each for each in CLOSED if each != 'mesh'])
@examples(1)
@given(seed=seeds, size=st.sampled_from([0.02, 0.1, 0.5]), far=st.sampled_from([0.0, 0.05, 0.1]))
def test_the_deepest_point_of_a_triangle(folder, shape, seed, size, far):
    """Of triangles that touch a convex collider of 5 cm, or pass it by."""
    generator, body = np.random.default_rng(seed), solid(shape, 0.05, folder)
    collider = RigidCollider(
        ColliderParameters(name='solid', **body.parameters), 0.01, 1.0, np.float64
    )
    row = collider.rows(np.zeros(3), np.zeros(2), triangles=True)[0]
    points = generator.normal(0, size / 2, (3, 3)) + far * generator.normal(size=3)
    fields = MeshFields([collider], np.float64).of(collider)
    found, *weights = deepest_point(points, (collider.triangle_kind, row, fields), 1.0, 1e-6)[:4]
    right = -deepest(points[None], body.distance, 1e-6, levels=14)
    assert found == pytest.approx(body.distance(np.array(weights)[None] @ points)[0], abs=2e-6)
    assert found < right + 1e-5

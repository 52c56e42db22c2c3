# SPDX-License-Identifier: Apache-2.0
"""The promise of `export.mesh`: closed, on the surface, and the right way round."""

from collections import Counter

import numpy as np
import pytest

from limit_surface_ros.errors import RangeError
from limit_surface_ros.export.mesh import mesh_of
from limit_surface_ros.surface.kinds.point_contacts import PointContacts
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.surface.scaling import Scaling

BALL = PowerSum.norms([np.eye(3)], Scaling(0.1, 4.0))
TRIANGLE = PointContacts([[-1, -1], [-1, 2], [2, -1]], [1.0, 1.0, 1.0])


@pytest.mark.parametrize("cells", [1, 2, 7])
def test_counts_are_those_of_a_closed_surface(cells):
    mesh = mesh_of(BALL, cells)
    assert len(mesh.vertices) == 4 * cells**2 + 2
    assert len(mesh.triangles) == 8 * cells**2
    edges = Counter(
        (int(a), int(b))
        for triangle in mesh.triangles
        for a, b in zip(triangle, np.roll(triangle, -1), strict=True)
    )
    # Each edge is walked once in each direction: no hole, no triangle turned over.
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


@pytest.mark.parametrize("surface", [BALL, TRIANGLE])
def test_vertices_lie_on_the_surface_and_normals_point_out(surface):
    mesh = mesh_of(surface, 6)
    np.testing.assert_allclose(surface.load_factor(mesh.vertices), 1.0, rtol=1e-9)
    assert ((mesh.vertices * mesh.normals).sum(axis=1) > 0.0).all()


def test_triangles_are_counter_clockwise_seen_from_outside():
    mesh = mesh_of(BALL, 4)
    a, b, c = np.swapaxes((mesh.vertices / BALL.scaling.wrench_unit)[mesh.triangles], 0, 1)
    assert ((np.cross(b - a, c - a) * (a + b + c)).sum(axis=1) > 0.0).all()


def test_the_mesh_of_a_ball_fills_it():
    scaled = mesh_of(BALL, 24).vertices / BALL.scaling.wrench_unit
    a, b, c = np.swapaxes(scaled[mesh_of(BALL, 24).triangles], 0, 1)
    volume = (a * np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * np.pi, rel=5e-3)


def test_triangles_are_of_similar_size():
    scaled = mesh_of(BALL, 12).vertices / BALL.scaling.wrench_unit
    a, b, c = np.swapaxes(scaled[mesh_of(BALL, 12).triangles], 0, 1)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert areas.max() < 4.0 * areas.min()


def test_a_mesh_without_cells_is_refused():
    with pytest.raises(RangeError, match="cells must be at least 1, got 0"):
        mesh_of(BALL, 0)


def test_a_surface_without_bound_has_no_mesh():
    with pytest.raises(RangeError, match="bounds every direction"):
        mesh_of(PowerSum.norms([np.diag([1.0, 1.0, 0.0])]), 2)

# SPDX-License-Identifier: Apache-2.0
"""The promise of Figures 3.1 to 3.5: what the text says holds, but for a misprinted sign."""

import numpy as np
import pytest

from limit_surface_ros.thesis import bodies
from limit_surface_ros.thesis.exact_surfaces import STUDIES
from limit_surface_ros.thesis.settings import QUICK
from limit_surface_ros.thesis.store import Store

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.number)
def test_every_claim_of_the_exact_surfaces_holds_but_the_sign_of_the_moment(tmp_path, study):
    findings = study.carry_out(QUICK, Store(tmp_path, QUICK))
    wrong = [claim.said for claim in findings.claims if not claim.holds]
    assert wrong == [said for said in wrong if "equation (3.1)" in said]
    assert len(wrong) == (study.number == "3.1")
    assert findings.tables


@pytest.mark.parametrize(
    ("body", "friction"),
    [
        (bodies.square_patch(), 1.0),
        (bodies.triangle_patch(), 1.5),
        (bodies.ellipse_patch(), 1.0),
    ],
)
def test_patches_have_their_centroid_at_the_reference_point(body, friction):
    assert len(body.points) == 400
    np.testing.assert_allclose(body.friction_limits.sum(), friction)
    np.testing.assert_allclose(body.points.mean(axis=0), 0.0, atol=1e-12)


def test_the_cells_of_the_triangle_lie_in_it_and_fill_it():
    points = bodies.triangle_patch().points
    assert points.min() > -40 / 150
    assert (points @ [1.0, 1.0]).max() < 40 / 150
    # Second moments of a right-angled triangle about its centroid: leg^2 / 18, -leg^2 / 36.
    leg = 120 / 150
    spread = points.T @ points / len(points)
    np.testing.assert_allclose(np.diag(spread), leg**2 / 18, rtol=3e-3)
    np.testing.assert_allclose(spread[0, 1], -(leg**2) / 36, rtol=3e-3)

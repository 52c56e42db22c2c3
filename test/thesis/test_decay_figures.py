# SPDX-License-Identifier: Apache-2.0
"""The promise of Figures 2.1 to 2.16: the thesis's own numbers, to the digit, and its claims."""

import numpy as np
import pytest

from limit_surface_ros.thesis import beyond_decays, decay_fits, decay_system, more_functions
from limit_surface_ros.thesis.settings import QUICK
from limit_surface_ros.thesis.store import Store

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")


# Certified by linear programming on the thesis's grid.
@pytest.mark.parametrize(
    ("roots", "terms", "error"), [(5, 9, 2.8196e-2), (8, 15, 1.6145e-2), (62, 123, 2.0123e-3)]
)
def test_the_thesis_fits_come_out_to_four_digits(roots, terms, error):
    fit = decay_fits.thesis_fit(roots, 2000)
    assert fit.sum.terms == terms
    assert float(f"{fit.max_error:.4e}") == error


def claims_of(studies, number, folder):
    study = next(study for study in studies if study.number == number)
    findings = study.carry_out(QUICK, Store(folder, QUICK))
    assert findings.tables
    return {claim.said: claim.holds for claim in findings.claims}


@pytest.mark.parametrize("number", ["2.1", "2.2"])
def test_what_is_said_of_the_hockey_stick_holds(tmp_path, number):
    assert all(claims_of(decay_system.STUDIES, number, tmp_path).values())


def test_only_the_printed_polynomials_are_wrong(tmp_path):
    verdicts = claims_of(decay_system.STUDIES, "2.3", tmp_path)
    assert [said for said, holds in verdicts.items() if not holds] == [
        "The printed coefficients (2.2) are those polynomials."
    ]
    verdicts = claims_of(decay_system.STUDIES, "2.4", tmp_path)
    assert [said for said, holds in verdicts.items() if not holds] == [
        "Equation (2.4) is that of the polynomials (2.2)."
    ]


def test_pieces_and_equation_are_printed_with_those_of_the_thesis_beside_them(tmp_path):
    for number, cells in (("2.3", 6), ("2.4", 7)):
        study = next(study for study in decay_system.STUDIES if study.number == number)
        (listing,) = study.carry_out(QUICK, Store(tmp_path, QUICK)).listings.values()
        rows = [line.split() for line in listing.splitlines()]
        assert [row[-7 if number == "2.3" else -8] for row in rows] == ["here", "printed"] * cells
    # exp(-lambda): lambda^6 + 1.991 lambda^5 + ..., and what it is to the digit, 2 lambda^5.
    assert rows[3][-7:-5] == ["1.0000", "1.9910"]
    assert float(rows[2][-6]) == pytest.approx(2.0, abs=0.02)


def test_without_the_slowest_roots_the_fit_is_worse_and_a_longer_interval_tames_what_follows(
    tmp_path,
):
    left_out, longer = beyond_decays.STUDIES
    rows = left_out.carry_out(QUICK, Store(tmp_path, QUICK)).tables["rightmost"]
    for basis in ("basis 0", "basis 1", "basis 2", "basis 3"):
        assert rows[f"{basis} within"][-1] > 2.0 * rows[f"{basis} within"][0]
    rows = longer.carry_out(QUICK, Store(tmp_path, QUICK)).tables["interval"]
    six = list(rows["end [s]"]).index(6.0)
    for basis in ("basis 1", "basis 2", "basis 3"):
        assert rows[f"{basis} after"][-1] < 0.1 * rows[f"{basis} after"][six]
        assert rows[f"{basis} after"][0] > 1e3 * rows[f"{basis} after"][six]


@pytest.mark.parametrize("number", ["2.8", "2.9", "2.10", "2.11", "2.12", "2.13"])
def test_what_is_said_of_the_other_functions_holds(tmp_path, number):
    assert all(claims_of(more_functions.STUDIES, number, tmp_path).values())


def test_basis_3_fits_as_well_as_the_others_up_to_6_s_and_basis_0_is_worst_after(tmp_path):
    verdicts = claims_of(more_functions.STUDIES, "2.14", tmp_path)
    struggles, projects = verdicts.values()
    assert not struggles
    assert projects


def test_better_rates_beat_those_of_the_thesis_at_nine_terms():
    thesis = decay_fits.thesis_fit(5, 2000).max_error
    assert decay_fits.other_fit("best", 9).fit.max_error < 0.25 * thesis


def test_the_polynomials_are_drawn_where_they_hold():
    kernel = decay_system.kernel_of("f1", 2000)
    table = decay_system.pieces_table(kernel)
    inside = (np.abs(table["t [s]"] % 1.0 - 0.5) < 0.45).nonzero()
    np.testing.assert_allclose(
        table["polynomials [1/s^2]"][inside],
        table["exact without impulses [1/s^2]"][inside],
        atol=0.02,
    )

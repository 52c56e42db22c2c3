# SPDX-License-Identifier: Apache-2.0
"""The promise of Figures 3.6 to 3.12: fits made once, errors measured afresh, claims judged."""

import csv
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from limit_surface_ros.fitting.search import process_pool
from limit_surface_ros.fitting.workers import available_cores
from limit_surface_ros.surface.convexity import is_convex
from limit_surface_ros.thesis.fits import FAMILIES, LABELS, Fit, fitted, training_pairs
from limit_surface_ros.thesis.run import carry_out
from limit_surface_ros.thesis.settings import FULL, QUICK
from limit_surface_ros.thesis.store import Store
from limit_surface_ros.thesis.studies import STUDIES
from limit_surface_ros.thesis.surface_errors import Errors, thesis_fits

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")

DOCUMENTED = Path(__file__).resolve().parents[2] / "docs" / "explanation" / "thesis_claims.md"
TINY = replace(QUICK, motions=120, per_facet=8, tests=100, directions=60, starts=2)


def test_every_figure_of_both_chapters_has_its_counterpart():
    numbers = [study.number for study in STUDIES]
    figures = [f"2.{n}" for n in range(1, 17)] + [f"3.{n}" for n in range(1, 13)]
    assert numbers == figures + [f"B.{n}" for n in range(1, 6)]


def test_every_family_has_a_label():
    assert set(LABELS) == set(FAMILIES)


def test_noise_changes_loads_and_motions_by_about_what_is_said():
    clean, noisy = (training_pairs("whole_face", flag, TINY) for flag in (False, True))
    assert np.std(noisy.wrenches - clean.wrenches) == pytest.approx(TINY.noise, rel=0.2)


def test_errors_of_load_and_motion_are_sorted_and_within_their_range(tmp_path):
    errors = Errors(thesis_fits("three_points")[-2:], Store(tmp_path, TINY))
    for values in (*errors.velocity.values(), *errors.force.values()):
        assert (np.diff(values) >= 0.0).all()
    assert all(v[0] >= 0.0 and v[-1] <= 2.0 for v in errors.velocity.values())


def test_a_fit_is_the_same_when_it_is_read_again(tmp_path):
    fit = Fit("three_points", "norms3")
    first = fitted(fit, Store(tmp_path, TINY))
    again = fitted(fit, Store(tmp_path, TINY))
    np.testing.assert_array_equal(first.matrices, again.matrices)


def test_the_figures_of_errors_judge_claims_and_leave_their_numbers(tmp_path):
    studies = [study for study in STUDIES if study.number in ("3.9", "3.12")]
    steps = []
    page = carry_out(studies, Store(tmp_path, TINY), lambda *step: steps.append(step))
    assert steps[-1][0] == steps[-1][1]
    verdicts = ("yes", "partly", "no")
    assert sum(page.read_text().count(f'class="{verdict}"') for verdict in verdicts) == 8
    with (tmp_path / "figure_3_09" / "velocity.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == TINY.tests
    assert float(rows[-1]["share"]) == 1.0
    assert "4th order polynomial" in rows[0]
    assert len(list((tmp_path / "models").glob("*.yaml"))) > 20


def findings_of(number, folder):
    study = next(study for study in STUDIES if study.number == number)
    return study.carry_out(TINY, Store(folder, TINY))


def test_the_convex_polynomial_stands_beside_that_of_least_squares(tmp_path):
    pytest.importorskip("cvxpy", reason="cvxpy fits the convex polynomial")
    found = findings_of("B.4", tmp_path)
    dented, better = found.claims
    assert dented.verdict == "holds partly"
    assert set(found.pictures) == {"sections", "errors"}
    assert better.measured
    convex = fitted(Fit("three_points", "convex_polynomial", "J1"), Store(tmp_path, TINY))
    assert is_convex(convex).dented_share == 0.0


@pytest.mark.nightly
def test_weights_and_minima_are_counted_for_every_fit(tmp_path):
    weights = findings_of("B.3", tmp_path).tables["weights"]["weight"]
    assert weights.tolist() == [0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0]
    assert len(findings_of("B.5", tmp_path).tables["minima"]["fit"]) == 16


def test_without_cvxpy_the_convex_polynomial_is_left_out_and_the_page_says_so(
    tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    findings = findings_of("B.4", tmp_path)
    assert "cvxpy" in findings.remarks
    assert not findings.pictures


@pytest.mark.nightly
def test_the_documentation_shows_the_verdicts_that_come_out(tmp_path):
    pytest.importorskip("cvxpy", reason="cvxpy fits the convex polynomial")
    with process_pool(available_cores()) as executor:
        carry_out(STUDIES, Store(tmp_path, FULL, executor))
    said = re.compile(r"^\| (\S+) \| (.+?) \| .+ \| (\w[\w ]+) \|$", re.MULTILINE)
    found = said.findall((tmp_path / "claims.md").read_text())
    assert len(found) > 40
    assert said.findall(DOCUMENTED.read_text("utf-8")) == found

# SPDX-License-Identifier: Apache-2.0
"""The promise of `thesis.store` and its records: nothing is worked out twice, nothing is half."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest

from limit_surface_ros.files.surface_file import SurfaceModel
from limit_surface_ros.plots.canvas import new_figure
from limit_surface_ros.surface.kinds.power_sum import PowerSum
from limit_surface_ros.thesis.findings import Claim, Findings, Study
from limit_surface_ros.thesis.records import csv_text
from limit_surface_ros.thesis.run import carry_out
from limit_surface_ros.thesis.settings import QUICK
from limit_surface_ros.thesis.store import Store

pytest.importorskip("matplotlib", reason="matplotlib draws the pictures")


class Counter:
    """Studies that count how often they are carried out."""

    def __init__(self, *numbers, fail=()):
        """Note which studies there are, and which of them fail."""
        self.carried_out = []
        self.fail = set(fail)
        self.studies = [Study(number, f"Figure {number}", self.of(number)) for number in numbers]

    def of(self, number):
        def study(settings, store):
            if number in self.fail:
                raise KeyboardInterrupt
            self.carried_out.append(number)
            with new_figure(2.0, 1.0) as figure:
                figure.subplots().plot([0, 1])
            claim = Claim(f"said <{number}>", "seen", np.bool_(True))
            return Findings({"thesis": figure, "beyond": figure}, {"t": {"a": [0.1]}}, (claim,))

        return study


def test_a_finished_figure_is_not_worked_out_again(tmp_path):
    counter = Counter("2.1", "2.2")
    first = carry_out(counter.studies, Store(tmp_path, QUICK)).read_text()
    second = carry_out(counter.studies, Store(tmp_path, QUICK)).read_text()
    assert counter.carried_out == ["2.1", "2.2"]
    assert first == second


def test_an_interrupted_run_goes_on_where_it_was(tmp_path):
    counter = Counter("2.1", "2.2", "2.3", fail={"2.2"})
    with pytest.raises(KeyboardInterrupt):
        carry_out(counter.studies, Store(tmp_path, QUICK))
    assert not (tmp_path / "index.html").exists()
    counter.fail.clear()
    carry_out(counter.studies, Store(tmp_path, QUICK))
    assert counter.carried_out == ["2.1", "2.2", "2.3"]


def test_other_settings_are_worked_out_anew(tmp_path):
    counter = Counter("2.1")
    carry_out(counter.studies, Store(tmp_path, QUICK))
    carry_out(counter.studies, Store(tmp_path, replace(QUICK, seed=2)))
    assert counter.carried_out == ["2.1", "2.1"]


@pytest.mark.parametrize("name", ["thesis.png", "t.csv", "record.json"])
def test_a_figure_that_lost_a_file_is_worked_out_again(tmp_path, name):
    counter = Counter("2.1")
    carry_out(counter.studies, Store(tmp_path, QUICK))
    (tmp_path / "figure_2_01" / name).unlink()
    carry_out(counter.studies, Store(tmp_path, QUICK))
    assert counter.carried_out == ["2.1", "2.1"]


def test_a_record_that_is_cut_short_counts_as_none(tmp_path):
    counter = Counter("2.1")
    carry_out(counter.studies, Store(tmp_path, QUICK))
    record = tmp_path / "figure_2_01" / "record.json"
    record.write_text(record.read_text()[:-40])
    carry_out(counter.studies, Store(tmp_path, QUICK))
    assert counter.carried_out == ["2.1", "2.1"]


def test_a_fit_is_kept_and_counted(tmp_path):
    made = []

    def fit():
        made.append(1)
        return SurfaceModel("model", PowerSum.norms([np.eye(3)]))

    def study(settings, store):
        store.surface("model", fit)
        with new_figure(1.0, 1.0) as figure:
            pass
        return Findings({"thesis": figure}, {})

    studies = [Study("3.1", "one", study, ("model",)), Study("3.2", "two", study, ("model",))]
    steps = []
    carry_out(studies, Store(tmp_path, QUICK), lambda done, total: steps.append((done, total)))
    assert len(made) == 1
    assert steps[0] == (0, 3)
    assert steps[-1] == (3, 3)
    assert steps == sorted(steps)


def test_the_page_holds_its_pictures_and_says_what_holds(tmp_path):
    page = carry_out(Counter("2.1", "2.14").studies, Store(tmp_path, QUICK)).read_text()
    sources = re.findall(r'<img [^>]*src="([^"]*)"', page)
    assert len(sources) == 4
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert "<script" not in page
    assert "http" not in page
    assert "said &lt;2.1&gt;" in page
    assert "2 hold, 0 hold partly, 0 do not hold" in page
    assert (tmp_path / "claims.md").read_text().count("| seen | holds |") == 2
    assert 'href="figure_2_14/t.csv"' in page


def test_numbers_of_a_table_come_back_bit_for_bit():
    values = np.random.default_rng(1).normal(size=5) * 10.0 ** np.arange(-200, 300, 100)
    rows = list(csv.reader(csv_text({"x [m]": values, "n": ["a"] * 5}).splitlines()))
    assert rows[0] == ["x [m]", "n"]
    assert [float(row[0]) for row in rows[1:]] == values.tolist()


def test_columns_of_two_lengths_are_no_table():
    with pytest.raises(ValueError, match="zip"):
        csv_text({"a": [1, 2], "b": [1]})

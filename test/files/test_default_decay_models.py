# SPDX-License-Identifier: Apache-2.0
"""The decay models that the package ships can be read and are what their names say."""

from pathlib import Path

import numpy as np

from limit_surface_ros.decay.examples import hockey_stick
from limit_surface_ros.files.decay_file import read_decay_model

FOLDER = Path(__file__).resolve().parents[2] / "config" / "decay"


def test_every_shipped_model_tells_the_command_that_made_it():
    paths = sorted(FOLDER.glob("*.yaml"))
    assert [path.stem for path in paths] == ["exponential", "hockey_stick"]
    for path in paths:
        assert path.read_text().startswith("# Made by: fit_decay ")
        assert read_decay_model(path).name == path.stem


def test_the_exponential_is_one():
    x = read_decay_model(FOLDER / "exponential.yaml").sum
    times = np.linspace(0.0, 20.0, 500)
    np.testing.assert_allclose(x(times), np.exp(-times), rtol=0, atol=1e-13)


def test_the_hockey_stick_is_met_to_its_stated_error():
    model = read_decay_model(FOLDER / "hockey_stick.yaml")
    times = np.linspace(*model.time_span, 50001)
    error = np.abs(model.sum(times) - hockey_stick()(times)).max()
    assert error <= model.max_error * 1.001
    assert model.max_error < 3.6e-3

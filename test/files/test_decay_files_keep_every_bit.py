# SPDX-License-Identifier: Apache-2.0
"""A decay model written and read back is the same, and a bad file says what is wrong with it."""

import re
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from limit_surface_ros.decay.delay.pieces import PiecewisePolynomial
from limit_surface_ros.decay.delay.system import DelaySystem
from limit_surface_ros.decay.exponential_sum import ExponentialSum
from limit_surface_ros.decay.tail import Tail
from limit_surface_ros.errors import FileError, RangeError
from limit_surface_ros.files.decay_file import DecayModel, read_decay_model, write_decay_model


def a_model(seed=0, system=None):
    rng = np.random.default_rng(seed)
    rates = -rng.lognormal(0.0, 3.0, 5) + 1j * np.abs(rng.normal(size=5)) * [0, 1, 1, 1, 1]
    coefficients = rng.lognormal(0.0, 8.0, 5) + 1j * rng.normal(size=5) * [0, 1, 1, 1, 1]
    x = ExponentialSum(rates, coefficients)
    return DecayModel("a model", x, (0.0, 6.0), "inf", 0.1, system, {"method": "dde", "terms": 9})


@given(st.integers(min_value=0, max_value=2**32 - 1))
@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_model_written_and_read_back_is_the_same_bit_for_bit(tmp_path, seed):
    model = a_model(seed)
    write_decay_model(model, tmp_path / "model.yaml", "made by a test")
    back = read_decay_model(tmp_path / "model.yaml")
    assert back.sum.rates.tobytes() == model.sum.rates.tobytes()
    assert back.sum.coefficients.tobytes() == model.sum.coefficients.tobytes()
    assert (back.name, back.time_span, back.norm) == (model.name, model.time_span, model.norm)
    assert back.max_error == model.max_error
    assert dict(back.fit) == dict(model.fit)
    assert back.system is None


def test_the_delay_system_behind_a_model_comes_back_too(tmp_path):
    rng = np.random.default_rng(1)
    pieces = PiecewisePolynomial([0.0, 1.0, 2.5], rng.normal(size=(2, 4)))
    write_decay_model(
        a_model(system=DelaySystem([0.0, 1.0], [-1.0, 1.0], pieces)), tmp_path / "model.yaml"
    )
    system = read_decay_model(tmp_path / "model.yaml").system
    assert system is not None
    np.testing.assert_array_equal(system.delays, [0.0, 1.0])
    np.testing.assert_array_equal(system.strengths, [-1.0, 1.0])
    np.testing.assert_array_equal(system.pieces.edges, pieces.edges)
    np.testing.assert_array_equal(system.pieces.coefficients, pieces.coefficients)


def test_a_file_cut_short_anywhere_is_refused(tmp_path):
    pieces = PiecewisePolynomial([0.0, 1.0], [[1.0, 2.0]])
    whole = tmp_path / "model.yaml"
    write_decay_model(a_model(system=DelaySystem([1.0], [-1.0], pieces)), whole, "a header")
    text, cut = whole.read_text(), tmp_path / "cut.yaml"
    for length in range(len(text.rstrip())):
        cut.write_text(text[:length])
        with pytest.raises(FileError):
            read_decay_model(cut)


GOOD = {
    "schema": "1",
    "kind": "exponential_sum",
    "name": "m",
    "rates": "[[-1.0, 0.0]]",
    "coefficients": "[[1.0, 0.0]]",
    "time_span": "[0.0, 6.0]",
    "norm": "inf",
    "max_error": "0.1",
}


@pytest.mark.parametrize(
    ("text", "program"),
    [
        ("kind: power_sum\ncharacteristic_length: 0.1\n", "plot_surface"),
        ("points: [[0, 0]]\n", "fit_surface"),
    ],
)
def test_files_of_limit_surfaces_are_sent_to_the_right_program(tmp_path, text, program):
    path = tmp_path / "other.yaml"
    path.write_text(f"schema: 1\nname: m\n{text}")
    with pytest.raises(FileError, match=rf"kind: .*{program}.*of kind exponential_sum"):
        read_decay_model(path)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("schema", "2", "schema: must be one of 1"),
        ("kind", "power_sum", "kind: must be one of exponential_sum"),
        ("name", None, "name: missing"),
        ("rates", "[[.nan, 0.0]]", "rates.*finite"),
        ("rates", "[['0.001', 0.0]]", "rates.*write it as the number 0.001"),
        ("rates", "[[-1.0, -2.0]]", "rates: .*Im >= 0"),
        ("rates", "[[0.5, 0.0]]", "rates: .*must decay"),
        ("rates", "[-1.0]", "rates: must be an array of n x 2"),
        ("coefficients", "[[1.0, 2.0]]", "must be real"),
        ("time_span", "[6.0, 0.0]", "time_span"),
        ("max_error", "-0.1", "max_error: must be at least 0"),
        ("colour", "red", "colour: is not known here"),
        ("system", "{edges: [0.0, 1.0]}", "system.edges: .*belong together"),
        ("system", "{delays: [-1.0], strengths: [1.0]}", "system.delays: .*at least 0"),
        ("fit", "[1]", "fit: must be a mapping"),
    ],
)
def test_a_bad_file_is_refused_with_file_key_and_reason(tmp_path, key, value, message):
    path = tmp_path / "bad.yaml"
    entries = {**GOOD, key: value}
    path.write_text("".join(f"{k}: {v}\n" for k, v in entries.items() if v is not None))
    with pytest.raises(FileError, match=re.escape(str(path)) + ": .*" + message):
        read_decay_model(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": " "}, "name"),
        ({"time_span": (1.0, 1.0)}, "time_span"),
        ({"max_error": float("nan")}, "max_error"),
        ({"sum": ExponentialSum([0.1], [1.0])}, "must decay"),
    ],
)
def test_a_model_that_makes_no_sense_is_refused(change, message):
    good = {"name": "m", "sum": ExponentialSum([-1.0], [1.0]), "time_span": (0.0, 1.0)}
    with pytest.raises(RangeError, match=message):
        DecayModel(**{**good, "norm": "inf", "max_error": 0.1, **change})


def test_reading_decay_models_imports_no_scipy():
    program = (
        "import sys, limit_surface_ros.files.decay_file; "
        "sys.exit(any(name.startswith('scipy') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_model_that_decays_to_a_constant_is_kept(tmp_path):
    x = ExponentialSum([0.0, -1.0], [0.25, 1.0])
    write_decay_model(DecayModel("creep", x, (0.0, 6.0), "2", 0.1), tmp_path / "model.yaml")
    back = read_decay_model(tmp_path / "model.yaml").sum
    assert back.constant == 0.25
    assert back.time_to_level(0.5) == x.time_to_level(0.5)


def test_what_a_model_states_of_its_tail_and_noise_is_kept(tmp_path):
    tail = Tail(0.1, 0.30000000000000004, "after 6 s it stays small")
    model = DecayModel("m", a_model().sum, (0.0, 6.0), "2", 0.1, tail=tail, noise=0.1 + 0.2)
    write_decay_model(model, tmp_path / "model.yaml")
    back = read_decay_model(tmp_path / "model.yaml")
    assert back.tail == tail
    assert back.noise == model.noise
    text = (tmp_path / "model.yaml").read_text()
    (tmp_path / "model.yaml").write_text(text.replace("envelope: 0.1", "envelope: -0.1"))
    with pytest.raises(FileError, match="envelope"):
        read_decay_model(tmp_path / "model.yaml")

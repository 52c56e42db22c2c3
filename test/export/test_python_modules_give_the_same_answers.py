# SPDX-License-Identifier: Apache-2.0
"""The promise of `--to casadi` and `--to jax`: the library's answers, and derivatives of them."""

import importlib.util
import os
import sys

import numpy as np
import pytest

from export_models import MODELS, SCALING, scaled_error, vectors
from limit_surface_ros.export.portable import portable
from limit_surface_ros.export.python_modules import casadi_module, jax_module
from limit_surface_ros.surface import PowerSum

RHO = SCALING.characteristic_length


def loaded(text, folder):
    """Return the module of a text."""
    path = folder / "exported_model.py"
    path.write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
    try:
        spec.loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = before
    return module


def asked(name, count):
    """Return wrenches and twists (count, 3) without extreme sizes."""
    found = vectors(name, count + 2)[:count]
    return found * [1.0, 1.0, RHO], found / [1.0, 1.0, RHO]


@pytest.mark.parametrize("name", MODELS)
def test_casadi_functions_are_the_maps(name, tmp_path):
    pytest.importorskip("casadi", reason="casadi is not installed: make test_exports has it")
    surface = MODELS[name]
    functions = loaded(casadi_module(portable(surface), name, "A surface."), tmp_path).functions()
    count = 100 if "nearly" in name else 1000
    wrenches, twists = asked(name, count)
    right = np.array([surface.load_factor(each) for each in wrenches])
    found = np.asarray(functions["load_factor"].map(count)(wrenches.T)).ravel()
    assert np.abs(found / right - 1.0).max() < 1e-12
    for key, given, one, unit in (
        ("twist", wrenches, surface.twist_of_wrench, SCALING.twist_unit),
        ("wrench", twists, surface.wrench_of_twist, SCALING.wrench_unit),
    ):
        found = np.asarray(functions[key].map(count)(given.T)).T
        error = scaled_error(found, np.array([one(each) for each in given]), unit)
        assert np.quantile(error, 0.75 if "nearly" in name else 0.98) < 1e-12
        assert error.max() < 1e-9
    # The two quadratic maps are each other's inverse.
    there = np.asarray(functions["quadratic_twist"](wrenches[0])).ravel()
    back = np.asarray(functions["quadratic_wrench"](there)).ravel()
    kept = np.abs((back - wrenches[0]) / SCALING.wrench_unit).max()
    assert kept < 1e-9 * np.abs(wrenches[0] / SCALING.wrench_unit).max()


@pytest.mark.parametrize("name", ["norms_4", "dissipation_4", "thesis_3_convex"])
def test_casadi_differentiates_the_way_back(name, tmp_path):
    casadi = pytest.importorskip("casadi", reason="casadi is not installed")
    surface = MODELS[name]
    functions = loaded(casadi_module(portable(surface), name, "A surface."), tmp_path).functions()
    key, given, one = (
        ("wrench", asked(name, 40)[1][39], surface.wrench_of_twist)
        if name != "dissipation_4"
        else ("twist", asked(name, 40)[0][39], surface.twist_of_wrench)
    )
    vector = casadi.MX.sym("vector", 3)
    jacobian = casadi.Function(
        "jacobian", [vector], [casadi.jacobian(functions[key](vector), vector)]
    )
    found = np.asarray(jacobian(given))
    steps = np.diag(1e-6 * np.abs(given))
    right = np.array([(one(given + s) - one(given - s)) / (2.0 * s.sum()) for s in steps]).T
    assert np.abs(found - right).max() < 1e-6 * np.abs(right).max()


def test_casadi_leaves_out_the_way_back_of_a_dented_surface(tmp_path):
    pytest.importorskip("casadi", reason="casadi is not installed")
    rows = np.array([np.diag([1.0, 1.0, 1.0]), np.diag([40.0, 0.01, 0.01])])
    model = portable(PowerSum(rows, [1.0, 0.25], SCALING))
    functions = loaded(casadi_module(model, "dented", "A surface."), tmp_path).functions()
    assert sorted(functions) == ["load_factor", "quadratic_twist", "twist"]


@pytest.fixture(scope="module")
def jax():
    """Return JAX in double precision, on the processor."""
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    module = pytest.importorskip("jax", reason="jax is not installed: make test_exports has it")
    module.config.update("jax_enable_x64", True)
    return module


@pytest.mark.parametrize("name", MODELS)
def test_jax_functions_are_the_closed_maps_and_have_derivatives(name, tmp_path, jax):
    surface = MODELS[name]
    model = portable(surface)
    module = loaded(jax_module(model, name, "A surface."), tmp_path)
    wrenches, twists = asked(name, 2000)
    if model.gauge_of_loads:
        right = np.array([surface.load_factor(each) for each in wrenches])
        assert np.abs(np.asarray(module.load_factor(wrenches)) / right - 1.0).max() < 1e-12
        right = np.array([surface.twist_of_wrench(each) for each in wrenches])
        error = scaled_error(
            np.asarray(module.twist_of_wrench(wrenches)), right, SCALING.twist_unit
        )
        assert error.max() < 1e-12
        # d(g^2 / 2) is the quadratic twist; a gradient of a load factor comes by autodiff.
        gradient = jax.vmap(jax.grad(lambda w: 0.5 * module.load_factor(w) ** 2))(wrenches[:50])
        assert np.allclose(gradient, module.quadratic_twist(wrenches[:50]), rtol=1e-10, atol=0.0)
        second = jax.jacfwd(module.twist_of_wrench)(wrenches[60])
        assert np.abs(np.asarray(second) @ wrenches[60]).max() < 1e-12 * np.abs(second).max()
    else:
        right = np.array([surface.wrench_of_twist(each) for each in twists])
        error = scaled_error(
            np.asarray(module.wrench_of_twist(twists)), right, SCALING.wrench_unit
        )
        assert error.max() < 1e-12
        gradient = jax.vmap(jax.grad(module.dissipation))(twists[:50])
        assert np.allclose(gradient, module.wrench_of_twist(twists[:50]), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["thesis_2", "norms_with_corners", "triangle", "polynomial"])
def test_jax_has_answers_at_extreme_sizes_and_at_kinks_and_none_of_what_is_not_finite(
    name, tmp_path, jax
):
    surface = MODELS[name]
    model = portable(surface)
    module = loaded(jax_module(model, name, "A surface."), tmp_path)
    rows = [[1e-300, 2e-300, 1e-301], [1e300, -1e300, 1e299], [0.0, 0.0, 1.0], [1e-160, 0.0, 0.0]]
    if name == "triangle":
        # Rotations about support points: these add nothing to the load.
        rows += [[y, -x, 1.0] for x, y in surface.points]
    rows = np.array(rows)
    bad = np.array([[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [0.0, -np.inf, 1.0]])
    if model.gauge_of_loads:
        size, map_, right = module.load_factor, module.twist_of_wrench, surface.twist_of_wrench
        unit = SCALING.twist_unit
        factors = [surface.load_factor(each) for each in rows]
        np.testing.assert_allclose(size(rows), factors, rtol=1e-12)
    else:
        size, map_, right = module.dissipation, module.wrench_of_twist, surface.wrench_of_twist
        unit = SCALING.wrench_unit
    rights = np.array([right(each) for each in rows])
    assert scaled_error(np.asarray(map_(rows)), rights, unit).max() < 1e-12
    assert np.isnan(size(bad)).all()
    assert np.isnan(map_(bad)).all()
    zero = np.zeros(3)
    assert size(zero) == 0.0
    assert np.isnan(map_(zero)).all()
    assert np.array_equal(jax.grad(size)(zero), zero)

# SPDX-License-Identifier: Apache-2.0
"""The promise of `export_surface`: each target is written, and what is left out is named."""

import ast
import re
import shutil
import subprocess
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from export_models import MODELS
from limit_surface_ros.export.portable import portable
from limit_surface_ros.export.targets import SUFFIXES, export_surface
from limit_surface_ros.files.surface_file import SurfaceModel, write_surface_model
from limit_surface_ros.surface import PowerSum
from limit_surface_ros.tools.export_surface import main


@pytest.fixture
def model_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_surface_model(SurfaceModel("my box", MODELS["dissipation_4"]), tmp_path / "model.yaml")
    return tmp_path / "model.yaml"


@pytest.mark.parametrize("target", SUFFIXES)
def test_each_target_is_written_under_the_name_of_the_model(target, model_file, capsys):
    assert main([str(model_file), "--to", target]) == 0
    ending = "_ellipsoid" if target == "ellipsoid" else ""
    output = model_file.parent / f"my box{ending}{SUFFIXES[target]}"
    text = output.read_text(encoding="utf-8")
    assert "my box" in text or "my_box" in text
    assert "(0, 0) m" in text
    assert re.search(r"@[A-Z_]+@", text) is None
    assert f"written     {output.name}" in capsys.readouterr().out


@pytest.mark.parametrize("target", ["cpp", "casadi", "jax", "js"])
def test_numbers_are_kept_to_the_last_bit(target, model_file):
    assert main([str(model_file), "--to", target, "-o", f"out{SUFFIXES[target]}"]) == 0
    text = (model_file.parent / f"out{SUFFIXES[target]}").read_text(encoding="utf-8")
    surface = MODELS["dissipation_4"]
    for number in portable(surface).roots.ravel():
        assert repr(float(number)) in text


def test_the_ellipsoid_is_yaml_with_its_error(model_file):
    assert main([str(model_file), "--to", "ellipsoid", "-o", "L.yaml"]) == 0
    found = yaml.safe_load((model_file.parent / "L.yaml").read_text(encoding="utf-8"))
    assert np.shape(found["L"]) == (3, 3)
    assert 0.0 < found["mean_error_deg"] < found["error_95_deg"] < 90.0


def test_a_map_that_is_left_out_is_named(model_file, capsys):
    rows = np.array([np.diag([1.0, 1.0, 1.0]), np.diag([40.0, 0.01, 0.01])])
    write_surface_model(SurfaceModel("dented", PowerSum(rows, [1.0, 0.25])), model_file)
    assert main([str(model_file), "--to", "cpp"]) == 0
    assert "the load of a twist is not exported" in capsys.readouterr().out


def test_wrong_targets_and_places_are_refused(model_file, capsys):
    assert main([str(model_file), "--to", "cpp", "-o", "box.txt"]) == 2
    assert ".hpp" in capsys.readouterr().err
    assert main([str(model_file), "--to", "mujoco", "--spheres", "0"]) == 2
    assert "1 to 32" in capsys.readouterr().err
    assert main([str(model_file), "--to", "ellipsoid", "-o", str(model_file)]) == 2
    assert "input" in capsys.readouterr().err


STRANGE_NAMES = [
    "*/ x",
    'tri"""ple',
    "back\\slash\\",
    "\\U",
    "@NAME@",
    "--><x>",
    "\u03c0" * 200,
]


def exported(name, target):
    model = SurfaceModel(name, MODELS["dissipation_4"], frame_id=name)
    return export_surface(model, target).text


@pytest.mark.parametrize("name", STRANGE_NAMES)
def test_no_name_of_a_model_speaks_in_its_text(name, tmp_path):
    for target in ("casadi", "jax"):
        tree = ast.parse(exported(name, target))
        (given,) = (
            each.value.value
            for each in tree.body
            if isinstance(each, ast.Assign) and each.targets[0].id == "NAME"
        )
        assert given == name
    ElementTree.fromstring(exported(name, "mujoco"))
    assert np.shape(yaml.safe_load(exported(name, "ellipsoid"))["L"]) == (3, 3)
    script = tmp_path / f"model{SUFFIXES['js']}"
    script.write_text(exported(name, "js"), encoding="utf-8")
    if shutil.which("node"):
        subprocess.run(["node", "--check", script], check=True)


def test_headers_of_models_of_any_names_compile_beside_each_other(tmp_path):
    if not shutil.which("g++"):
        pytest.skip("no C++ compiler")
    headers = [exported(name, "cpp") for name in STRANGE_NAMES]
    for place, header in enumerate(headers):
        (tmp_path / f"{place}.hpp").write_text(header, encoding="utf-8")
    # A guard that two shared would hide one of them.
    guards = {re.search(r"^#ifndef (\w+)$", header, re.MULTILINE)[1] for header in headers}
    assert len(guards) == len(headers)
    source = tmp_path / "all.cpp"
    source.write_text("".join(f'#include "{place}.hpp"\n' for place in range(len(headers))))
    strict = ["-std=c++17", "-fsyntax-only", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["g++", *strict, source], check=True)

# SPDX-License-Identifier: Apache-2.0
"""A set of models is read whole or not at all, and finds models by name."""

from dataclasses import dataclass

import pytest

from limit_surface_ros.errors import FileError, UnknownModelError
from limit_surface_ros.files.model_set import ModelSet, read_model_set


@dataclass
class Named:
    name: str


def named(*names):
    return {name: Named(name) for name in names}


def read(path):
    if "bad" in path.name:
        raise FileError(f"{path}: bad")
    return Named(path.stem)


def test_the_first_model_is_the_default_unless_another_is_named():
    models = named("a", "b")
    assert ModelSet(models)[""].name == "a"
    assert ModelSet(models, "b")[""].name == "b"
    assert ModelSet(models, "b")["a"].name == "a"


def test_an_unknown_name_is_refused_with_the_names_that_are_loaded():
    with pytest.raises(UnknownModelError, match="no model 'c' is loaded; loaded are a, b"):
        ModelSet(named("a", "b"))["c"]
    with pytest.raises(UnknownModelError, match="no model 'c'"):
        ModelSet(named("a"), "c")


def test_of_thousands_of_models_a_message_lists_a_few():
    models = ModelSet(named(*(f"object_{i:04d}" for i in range(1000))))
    assert models.listed().endswith("object_0019 and 980 more")
    with pytest.raises(UnknownModelError) as refused:
        models["none"]
    assert len(str(refused.value)) < 400


def test_of_a_name_as_long_as_a_message_a_part_is_shown():
    with pytest.raises(UnknownModelError) as refused:
        ModelSet(named("m" * 1_000_000))["n" * 1_000_000]
    assert len(str(refused.value)) < 400


def test_no_model_at_all_is_refused():
    with pytest.raises(FileError, match="no model file is given"):
        read_model_set([], read)


def test_two_files_with_models_of_one_name_are_both_named(tmp_path):
    paths = [tmp_path / name for name in ("one.yaml", "two.yaml")]
    for path in paths:
        path.touch()
    with pytest.raises(FileError, match=r"two\.yaml: holds a model named 'same', as .*one\.yaml"):
        read_model_set(paths, lambda path: Named("same"))
    with pytest.raises(FileError, match=r"one\.yaml: holds a model named 'one', as .*one\.yaml"):
        read_model_set([paths[0], paths[0]], read)


def test_a_folder_stands_for_its_yaml_files_in_the_order_of_their_names(tmp_path):
    for name in ("b.yaml", "a.yaml", "notes.txt", ".part.yaml.x"):
        (tmp_path / name).touch()
    assert [model.name for model in read_model_set([tmp_path], read)] == ["a", "b"]


def test_one_bad_file_or_entry_refuses_the_whole_set(tmp_path):
    good = tmp_path / "good.yaml"
    bad = tmp_path / "bad.yaml"
    good.touch()
    bad.touch()
    (tmp_path / "empty").mkdir()
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    assert len(read_model_set([good], read)) == 1
    for entries, message in (
        ([good, bad], "bad.yaml: bad"),
        ([good, tmp_path / "absent.yaml"], "absent.yaml: no such file or folder"),
        ([good, tmp_path / "empty"], "the folder holds no"),
        ([good, ""], "an entry of the model files is empty"),
        ([good, tmp_path / "loop.yaml"], "loop.yaml: cannot be read: Too many levels"),
        ([good, "x" * 300], "cannot be read: .*File name too long"),
        ([good, "nul\0.yaml"], "cannot be read|no such file"),
    ):
        with pytest.raises(FileError, match=message):
            read_model_set(entries, read)

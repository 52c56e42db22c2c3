# SPDX-License-Identifier: Apache-2.0
"""Files read through `Section` give clean values or say file, key, fault and what is accepted."""

import os
import stat
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limit_surface_ros.checks import LARGEST
from limit_surface_ros.errors import FileError
from limit_surface_ros.files.atomic_write import check_writable, write_atomically
from limit_surface_ros.files.yaml_reader import _Loader, read_yaml, write_yaml


@pytest.fixture
def section_of(tmp_path):
    def write(text):
        path = tmp_path / "model.yaml"
        path.write_text(text)
        return read_yaml(path)

    return write


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x: '0.5'", r"model.yaml: x: '0.5' is text; write it as the number 0.5"),
        ("x: 0,5", r"x: must be a number, got '0,5'; write it with a decimal point"),
        ("x: 35 mm", r"x: must be a number, got '35 mm'; write the number alone: lengths are me"),
        ("x: 1e-3m", r"got '1e-3m'; write the number alone"),
        ("x: much", r"x: must be a number, got 'much'$"),
        ("x: .nan", "x: must be finite, got nan"),
        ("x: -.inf", "x: must be finite, got -inf"),
        ("x: true", "x: must be a number, got True"),
        ("x: [1]", r"x: must be a number, got \[1"),
        ("x: 0.0", "x: must be above 0.0 and at most 2.0, got 0.0"),
        ("x: 3", "x: must be above 0.0 and at most 2.0, got 3.0"),
        ("y: 1", "x: missing; it must be a number above 0.0 and at most 2.0"),
        ("x: null", "x: missing; it must be"),
        (f"x: 1{'0' * 101}", r"x: must be at most 1e\+100 in size"),
        (f"x: 1{'0' * 400}", "x: must be finite"),
    ],
)
def test_a_number_that_is_not_acceptable_is_refused_with_its_key(section_of, text, message):
    with pytest.raises(FileError, match=message):
        section_of(text).number("x", above=0.0, at_most=2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("m: [[1, 2], [3]]", "m: its rows must have one length"),
        ("m: [[1, 2], [3, .nan]]", r"m\[1\]\[1\]: must be finite, got nan"),
        ("m: [[1, 2], [3, '5']]", r"m\[1\]\[1\]: '5' is text; write it as the number 5.0"),
        ("m: [1, 2]", "m: must be an array of n x 2 numbers, got 2"),
        ("m: []", "m: must be an array of n x 2 numbers, got 0"),
        ("m: 4.0", "m: must be an array of n x 2 numbers, got a single number"),
        ("m: {a: 1}", "m: must be a number"),
    ],
)
def test_an_array_that_is_not_acceptable_is_refused_with_its_place(section_of, text, message):
    with pytest.raises(FileError, match=message):
        section_of(text).array("m", (None, 2))


def test_what_is_missing_is_told_with_what_is_accepted(section_of):
    section = section_of("a: 1")
    for read, accepted in (
        (lambda: section.choice("x", ["red", "blue"]), "one of red, blue"),
        (lambda: section.text("x"), "a text that is not empty"),
        (lambda: section.integer("x", at_least=1, at_most=9), "a whole number from 1 to 9"),
        (lambda: section.number("x"), "a number"),
        (lambda: section.array("x", (None, 2)), "an array of n x 2 numbers"),
        (lambda: section.section("x"), "a mapping of keys to values"),
    ):
        with pytest.raises(FileError, match=f"x: missing; it must be {accepted}$"):
            read()


def test_a_number_of_an_array_below_its_bound_is_named_with_its_place(section_of):
    with pytest.raises(FileError, match=r"m\[1\]\[0\]: must be at least 0.0, got -3.0$"):
        section_of("m: [[1, 2], [-3, 4]]").array("m", (2, 2), at_least=0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "model.yaml: is empty; a mapping of keys to values is accepted"),
        ("- 1", "holds list at its top level"),
        ("a: [1, 2", "line [12], column"),
        ("a: 1\nb: 2\na: 3", "line 3, column 1: key 'a' is given twice"),
        ("a: !!python/object:os.system {}", "could not determine a constructor"),
        ("a: \x07", "is not YAML"),
        ("a: !!bool maybe", "a tag such as !!bool stands before what is none; accepted are"),
        ("a: !!timestamp x", "a tag such as"),
        ("a: !!int ''", "a tag such as"),
        ("a: !!set [1]", "a tag such as"),
    ],
)
def test_text_that_is_no_mapping_is_refused_with_its_place(section_of, text, message):
    with pytest.raises(FileError, match=message):
        section_of(text)


def test_a_file_that_cannot_be_read_is_refused_with_its_name(tmp_path):
    with pytest.raises(FileError, match=r"absent\.yaml: cannot be read: No such file"):
        read_yaml(tmp_path / "absent.yaml")
    with pytest.raises(FileError, match="cannot be read: Is a directory"):
        read_yaml(tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"name: caf\xe9")
    with pytest.raises(FileError, match=r"latin\.yaml: is not UTF-8"):
        read_yaml(tmp_path / "latin.yaml")


def test_a_text_nested_too_deep_for_the_stack_is_refused(section_of):
    for text in ("[" * 40_000, "- " * 40_000, "a: " + "{b: " * 40_000):
        with pytest.raises(FileError, match=r"model\.yaml: is nested deeper than 100 levels$"):
            section_of(text)


@pytest.mark.parametrize("depth", [50, 900, 3000])
def test_a_number_or_array_nested_however_deep_is_refused_in_few_words(section_of, depth):
    for text in ("[" * depth + "1" + "]" * depth, "{b: " * depth + "1" + "}" * depth):
        for read in (lambda s: s.array("a", (None, 2)), lambda s: s.number("a")):
            with pytest.raises(FileError, match=r"a(\[0\])*: must be|nested deeper") as caught:
                read(section_of(f"a: {text}"))
            assert len(str(caught.value)) < 300


def test_anchors_that_repeat_each_other_cost_no_memory(section_of):
    laughs = ["&x0 [1, 1]", *(f"&x{i} [{', '.join([f'*x{i - 1}'] * 9)}]" for i in range(1, 30))]
    text = "\n".join(f"a{i}: {laugh}" for i, laugh in enumerate(laughs))
    with pytest.raises(FileError, match=r"line 7, .*: aliases stand for more than 1000000 values"):
        section_of(text)


def test_aliases_that_repeat_little_are_read(section_of):
    assert section_of("a: &a [1, 2]\nb: [*a, *a]").array("b", (2, 2)).tolist() == [[1, 2]] * 2


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("fit: &f {a: *f}", "line 1, column 13"),
        ("a: &x [1, [*x]]", "line 1, column 12"),
        ("&top\na: [1]\nb: *top", "line 3, column 4"),
        ("? &k [*k]\n: 1", "line 1, column 7"),
    ],
)
def test_what_refers_to_itself_is_refused_with_its_place(section_of, text, place):
    with pytest.raises(FileError, match=rf"model\.yaml: {place}: \*\w+ refers to what it is"):
        section_of(text)


@pytest.mark.parametrize(
    ("text", "number"), [("1e-3", 1e-3), ("1E5", 1e5), ("-2.5e6", -2.5e6), ("+1.e+2", 100.0)]
)
def test_powers_of_ten_are_numbers_with_and_without_a_point_and_a_sign(section_of, text, number):
    section = section_of(f"x: {text}\nm: [{text}]\nname: {text}")
    assert section.number("x") == section.array("m", (1,))[0] == number


def test_a_whole_number_may_be_a_power_of_ten(section_of):
    section = section_of("x: 1e3\ny: 1e-3\nz: 2.5e1")
    assert section.integer("x") == 1000
    assert section.integer("z") == 25
    with pytest.raises(FileError, match="y: must be a whole number from 0 on, got '1e-3'"):
        section.integer("y")


class Compared(str):
    """A text that counts how often it is compared."""

    __slots__ = ()
    __hash__ = str.__hash__
    times = 0

    def __eq__(self, other):
        Compared.times += 1
        return str.__eq__(self, other)


def test_keys_are_compared_in_linear_time(section_of, monkeypatch):
    # Twenty thousand were compared two hundred million times, which took four seconds.
    construct = _Loader.construct_object

    def comparable(self, node, deep=False):
        value = construct(self, node, deep)
        return Compared(value) if isinstance(value, str) else value

    monkeypatch.setattr(_Loader, "construct_object", comparable)
    keys = [f"key_{i}" for i in range(20_000)]
    assert len(section_of("\n".join(f"{key}: 1" for key in keys)).values) == len(keys)
    assert Compared.times < 10 * len(keys)
    with pytest.raises(FileError, match="line 20001, column 1: key 'key_7' is given twice"):
        section_of("\n".join(f"{key}: 1" for key in [*keys, "key_7"]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("? [1]\n: 2", "a key must be a text"),
        (f"{2**61 - 1}{'0' * 20}: 2", "a key must be a text, and not a number of that size"),
        (f"? {'[' * 90}1{']' * 90}\n: 2", "a key must be a text"),
        (f"x: {'9' * 1001}", "a number of 1001 digits; at most 1000 are read"),
        ("a:\n\tb: 1", "line 2, column 1: .*; a tab stands there, and YAML wants spaces"),
    ],
)
def test_keys_digits_and_tabs_that_are_not_acceptable_are_named(section_of, text, message):
    with pytest.raises(FileError, match=message):
        section_of(text)


def test_a_key_as_long_as_a_file_is_shown_in_part(section_of):
    key = "k" * 1_000_000
    with pytest.raises(FileError) as refused:
        section_of(f"{key}: 1").finish()
    assert len(str(refused.value)) < 500
    with pytest.raises(FileError) as refused:
        section_of(f"? {key}\n: 1\n? {key}\n: 1")
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize("number", ["1:30", "-1:30", "190:20:30.5", "010", "-017"])
def test_what_yaml_takes_for_a_number_of_base_60_or_8_is_refused_with_its_place(
    section_of, number
):
    with pytest.raises(FileError, match=rf"line 2, column 4: {number} is of base (60|8)"):
        section_of(f"y: 1\nx: {number}")
    assert section_of(f"x: '{number}'").text("x") == number


@pytest.mark.parametrize(
    ("text", "number"), [("0", 0), ("-0.5", -0.5), ("1_000", 1000), ("00.5", 0.5), (".5", 0.5)]
)
def test_other_numbers_are_read_as_they_stand(section_of, text, number):
    assert section_of(f"x: {text}").number("x") == number


def test_what_is_no_regular_file_or_too_large_is_neither_read_nor_replaced(tmp_path):
    fifo = tmp_path / "fifo.yaml"
    os.mkfifo(fifo)
    for path in (fifo, "/dev/zero"):
        with pytest.raises(FileError, match="it is no regular file"):
            read_yaml(path)
        with pytest.raises(FileError, match="it is no regular file"):
            write_atomically(path, "text")
    large = tmp_path / "large.yaml"
    with large.open("wb") as stream:
        stream.truncate(2**30)
    with pytest.raises(FileError, match="has 1073741824 bytes; at most"):
        read_yaml(large)


def test_a_link_keeps_pointing_where_it_did(tmp_path):
    (tmp_path / "model.yaml").write_text("old")
    (tmp_path / "link.yaml").symlink_to(tmp_path / "model.yaml")
    write_atomically(tmp_path / "link.yaml", "new")
    assert (tmp_path / "link.yaml").is_symlink()
    assert (tmp_path / "model.yaml").read_text() == "new"


def test_a_write_removes_what_killed_writes_of_the_same_file_left_behind(tmp_path):
    kept = [".model.yaml.fedcba9876543210", ".box.yaml.0123456789abcdef", ".model.yaml.notes"]
    ages = dict(zip([".model.yaml.0123456789abcdef", *kept], (700, 500, 700, 700), strict=True))
    for name, age in ages.items():
        part = tmp_path / name
        part.write_text("half")
        written = part.stat().st_mtime - age
        os.utime(part, (written, written))
    write_atomically(tmp_path / "model.yaml", "new")
    assert {path.name for path in tmp_path.iterdir()} == {"model.yaml", *kept}


def test_an_unknown_key_is_refused_with_those_that_are_known(section_of):
    section = section_of("outer: {known: 1, knwon: 2}").section("outer")
    section.number("known")
    with pytest.raises(FileError, match=r"outer\.knwon: is not known here; accepted are known"):
        section.finish()


def test_the_place_of_an_error_in_nested_sections_is_named(section_of):
    first, second = section_of("points: [{x: 1}, {x: two}]").sections("points")
    assert first.number("x") == 1.0
    with pytest.raises(FileError, match=r"points\[1\]\.x: must be a number, got 'two'"):
        second.number("x")


@given(st.lists(st.floats(min_value=-LARGEST, max_value=LARGEST), min_size=1, max_size=20))
def test_numbers_written_and_read_back_are_the_same_bit_for_bit(tmp_path_factory, numbers):
    path = tmp_path_factory.mktemp("yaml") / "numbers.yaml"
    write_yaml(path, {"numbers": np.array(numbers)})
    read = read_yaml(path).array("numbers", (None,))
    assert read.tobytes() == np.array(numbers).tobytes()


def test_a_file_that_cannot_be_written_leaves_the_old_one_and_no_litter(tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    target = folder / "model.yaml"
    target.mkdir()  # a folder cannot be replaced by a file
    with pytest.raises(FileError, match=r"model\.yaml: cannot be written"):
        write_atomically(target, "text")
    assert [path.name for path in folder.iterdir()] == ["model.yaml"]
    with pytest.raises(FileError, match="No such file or directory"):
        write_atomically(tmp_path / "absent" / "model.yaml", "text")


def test_an_interrupt_as_a_file_comes_to_be_leaves_the_old_one_and_no_litter(
    tmp_path, monkeypatch
):
    path = tmp_path / "model.yaml"
    path.write_text("old")

    def interrupted(self, *arguments):
        open_of_path(self, *arguments).close()
        raise KeyboardInterrupt

    open_of_path = Path.open
    monkeypatch.setattr(Path, "open", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_atomically(path, "new")
    monkeypatch.undo()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_written_file_has_the_permissions_that_the_umask_leaves(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "model.yaml", "text")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "model.yaml").stat().st_mode) == 0o640


def test_the_header_is_a_comment_at_the_top(tmp_path):
    write_yaml(tmp_path / "model.yaml", {"a": 1.0}, header="made by\n\nhand")
    assert (tmp_path / "model.yaml").read_text() == "# made by\n#\n# hand\na: 1.0\n"


@pytest.mark.parametrize("name", ["y" * 250 + ".yaml", "ü" * 127])
def test_names_as_long_as_file_systems_allow_can_be_written(tmp_path, name):
    target = tmp_path / name
    assert check_writable(target) == target
    write_atomically(target, "text")
    assert target.read_text() == "text"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("y" * 256, "cannot be written: File name too long"),
        ("absent/model.yaml", "its folder does not exist: make"),
        ("folder", "cannot be written: it is no regular file"),
        ("a\0b", "cannot be written: embedded null byte"),
        ("loop/model.yaml", r"model\.yaml: "),
    ],
)
def test_what_could_not_be_written_is_told_ahead(tmp_path, name, message):
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(FileError, match=message):
        check_writable(tmp_path / name)
    with pytest.raises(FileError, match="cannot be written"):
        write_atomically(tmp_path / name, "text")


def test_a_text_that_utf8_cannot_hold_is_refused(tmp_path):
    with pytest.raises(FileError, match="cannot be written: 'utf-8' codec"):
        write_atomically(tmp_path / "model.yaml", "name: \udcff")
    assert not list(tmp_path.iterdir())

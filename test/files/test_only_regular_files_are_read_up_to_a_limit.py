# SPDX-License-Identifier: Apache-2.0
"""A reader opens regular files alone, reads no more than its limit, and says what is wrong."""

import os

import pytest

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.regular_file import (
    check_regular,
    json_object,
    read_bytes,
    read_text,
)


@pytest.fixture(params=["pipe", "device", "folder", "absent"])
def no_file(request, tmp_path):
    """Return a path of something that is no regular file."""
    path = tmp_path / request.param
    if request.param == "device":
        return "/dev/zero"
    if request.param == "pipe":
        os.mkfifo(path)
    elif request.param == "folder":
        path.mkdir()
    return path


# The test's time limit would end a reader that waits for a writer.
@pytest.mark.parametrize("read", [check_regular, lambda path: read_bytes(path, 100)])
def test_what_is_no_regular_file_is_refused_and_never_waited_for(no_file, read):
    with pytest.raises(FileError, match=f"{no_file}: cannot be read: "):
        read(no_file)


def test_a_link_to_a_pipe_is_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "model.yaml").symlink_to(tmp_path / "pipe")
    with pytest.raises(FileError, match="it is no regular file"):
        read_text(tmp_path / "model.yaml", 100)


def test_a_name_that_no_file_can_have_is_told():
    for name in ("a\0b", "a" * 5000):
        with pytest.raises(FileError, match="cannot be read"):
            read_bytes(name, 100)


def test_no_more_than_the_limit_is_read(tmp_path):
    path = tmp_path / "data"
    path.write_bytes(b"0123456789")
    assert read_bytes(path, 10) == b"0123456789"
    with pytest.raises(FileError, match=r"has 10 bytes; at most 9 are read as a record"):
        read_bytes(path, 9, "a record")


def test_a_file_that_states_no_size_is_cut_off_at_the_limit():
    if not os.path.exists("/proc/self/maps"):  # noqa: PTH110 - no such file system everywhere
        pytest.skip("there is no /proc")
    with pytest.raises(FileError, match=r"has 101 bytes; at most 100"):
        read_bytes("/proc/self/maps", 100)


def test_text_may_begin_with_a_mark_of_the_byte_order_and_must_be_utf_8(tmp_path):
    path = tmp_path / "text"
    path.write_bytes("\ufeffä".encode())
    assert read_text(path, 100) == "ä"
    path.write_bytes(b"\xe4")
    with pytest.raises(FileError, match="is not UTF-8 text"):
        read_text(path, 100)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1]", "holds list at its top level"),
        ("{", "is not a JSON object"),
        ('{"a": ' + "[" * 200_000, "nested too deep"),
        ('{"a": ' + "9" * 5000 + "}", "is not a JSON object"),
    ],
)
def test_a_text_that_is_no_json_object_is_told_in_one_way(text, message):
    with pytest.raises(FileError, match=rf"here: .*{message}"):
        json_object(text, "here")


def test_a_json_object_is_read():
    assert json_object('{"rho_m": 0.1}', "here") == {"rho_m": 0.1}

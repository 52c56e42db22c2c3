# SPDX-License-Identifier: Apache-2.0
"""Recorded pushes are read whole, and every fault is named with file and line."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, FileError
from limit_surface_ros.files.pushes_csv import read_pushes

HEADER = '# {"rho_m": 0.05, "normal_force_N": 14.9}\n'
NAMES = "fx_N,fy_N,tau_Nm,vx,vy,omega\n"
ROW = "1.0,2.0,0.1,0.5,0.5,3.0\n"


def written(tmp_path, text):
    path = tmp_path / "pushes.csv"
    path.write_text(text)
    return path


def test_columns_may_stand_in_any_order_among_others(tmp_path):
    path = written(
        tmp_path, "\nid,omega,vy,vx,tau_Nm,fy_N,fx_N\na,6,5,4,3,2,1\n# note\nb,1,1,1,1,1,1\n"
    )
    pushes = read_pushes(path)
    np.testing.assert_array_equal(pushes.pairs.wrenches[0], [1, 2, 3])
    np.testing.assert_array_equal(pushes.pairs.twists[0], [4, 5, 6])
    assert len(pushes.pairs) == 2
    assert pushes.about == {}


def test_the_first_line_tells_about_the_recording(tmp_path):
    pushes = read_pushes(written(tmp_path, HEADER + NAMES + ROW))
    assert pushes.number("rho_m") == 0.05
    assert pushes.number("mass_kg") is None
    assert pushes.support() is None


def test_support_points_are_read_with_their_loads(tmp_path):
    about = '# {"support_points_m_body_frame": [[0, 0], [1, 0]], "support_loads_N": [1, 2]}\n'
    points, loads = read_pushes(written(tmp_path, about + NAMES + ROW)).support()
    assert points.shape == (2, 2)
    np.testing.assert_array_equal(loads, [1, 2])


def test_rows_are_selected_and_the_rest_held_out(tmp_path):
    pushes = read_pushes(written(tmp_path, NAMES + ROW + "9,9,9,9,9,9\n" + ROW))
    assert pushes.rows([1]).wrenches[0, 0] == 9
    assert len(pushes.rest([1])) == 2
    with pytest.raises(DataError, match="no row 3; rows are 0 to 2"):
        pushes.rows([3])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("# only a comment\n", "is empty; a line of column names"),
        (NAMES, "line 1: no rows follow"),
        (NAMES.replace("vx,", "") + ROW, "line 1: column vx is missing; needed are fx_N"),
        (NAMES.replace("vx", "vy") + ROW, "line 1: column vx is missing"),
        (NAMES.strip() + ",vx\n" + ROW, "line 1: column vx is given twice"),
        (
            NAMES + ROW + ROW.replace("2.0", "two"),
            "line 3: column fy_N: 'two' is no finite number",
        ),
        (
            NAMES + ROW.replace("2.0", ""),
            "line 2: column fy_N: '' is no finite number; --drop-bad leaves such rows out",
        ),
        (
            NAMES + ROW + ROW.replace("0.1", "nan"),
            "line 3: column tau_Nm: 'nan' is no finite number",
        ),
        (NAMES + ROW + ROW + "1,2,3\n", "line 4: has 3 cells, the columns are 6"),
        (NAMES + ROW + "1,2,3,4,5,6,7\n" + ROW, "line 3: has 7 cells, the columns are 6"),
        (NAMES + "1;2;3;4;5;6\n", "column fx_N is missing; .*separated by semicolons"),
        (NAMES.replace(",", ";") + ROW, "line 1: .* cells are read as separated by commas"),
        (
            NAMES + ROW + "1e300,1,1,1,1,1\n",
            r"line 3: column fx_N: 1e300 is beyond 1e\+100 in size",
        ),
        (NAMES + "1,1,1,0,1e-120,0\n", "line 2: the twist is below 1e-100 in size"),
        (NAMES + "0,0,0,1,1,1\n", "line 2: the wrench is zero"),
        (NAMES + "1,1,1,0,0,0\n", "line 2: the twist is zero"),
        (NAMES + ROW + "1" * 200_000 + "\n", "line 3: is not a row of CSV: field larger"),
        ("# {broken\n" + NAMES + ROW, "line 1: is not a JSON object"),
    ],
)
def test_faults_are_named_with_file_and_line(tmp_path, text, message):
    with pytest.raises(FileError, match=message) as error:
        read_pushes(written(tmp_path, text))
    assert "pushes.csv" in str(error.value)


def test_a_first_line_of_wrong_values_is_refused(tmp_path):
    pushes = read_pushes(written(tmp_path, HEADER.replace("0.05", '"x"') + NAMES + ROW))
    with pytest.raises(FileError, match=r"rho_m must be a number above 0, .*got 'x'"):
        pushes.number("rho_m")


def test_an_absent_file_is_named(tmp_path):
    with pytest.raises(FileError, match=r"none\.csv: cannot be read"):
        read_pushes(tmp_path / "none.csv")


@pytest.mark.parametrize("digits", [400, 5000])
def test_numbers_too_large_for_a_float_are_refused_with_file_and_line(tmp_path, digits):
    huge = "1" + "0" * digits
    with pytest.raises(FileError, match=r"pushes\.csv: line 1"):
        read_pushes(written(tmp_path, f'# {{"rho_m": {huge}}}\n{NAMES}{ROW}')).number("rho_m")
    about = '# {"support_points_m_body_frame": [[0, 0], [1, 0]], "support_loads_N": [1, %s]}\n'
    for load in (huge, "1e999"):
        with pytest.raises(FileError, match=r"pushes\.csv: line 1"):
            read_pushes(written(tmp_path, about % load + NAMES + ROW)).support()

# SPDX-License-Identifier: Apache-2.0
"""CSV as loggers, scopes and ROS write it is read as meant, or the cause is named."""

import numpy as np
import pytest

from limit_surface_ros.errors import DataError, FileError, RangeError
from limit_surface_ros.files.csv_table import CsvOptions
from limit_surface_ros.files.pushes_csv import read_pushes
from limit_surface_ros.files.response_csv import read_response

TIMES = np.arange(60) / 50.0
FORCES = np.round(8.0 * np.exp(-2.0 * TIMES), 4)
DROP = CsvOptions(drop_bad=True)


def written(tmp_path, text, encoding="utf-8", name="record.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def rows(form="{t:.2f},{x:.4f}"):
    return "".join(form.format(t=t, x=x) + "\n" for t, x in zip(TIMES, FORCES, strict=True))


def assert_the_response(read):
    np.testing.assert_allclose(read.record.knots, TIMES, atol=1e-9)
    np.testing.assert_allclose(read.record.values, FORCES)


AS_IT_IS = {
    "plain": ("t,force\n" + rows(), {}),
    "no_names": (rows(), {}),
    "spaces": ("t force\n" + rows("{t:.2f}   {x:.4f}"), {}),
    "tabs": ("t\tforce\n" + rows("{t:.2f}\t{x:.4f}"), {}),
    "quoted": ('"t","force"\n' + rows('"{t:.2f}","{x:.4f}"'), {}),
    "unit_row_below_names": (
        "t,x,F\n(s),(mm),(N)\n" + rows("{t:.2f},4.000,{x:.4f}"),
        {"value_column": "F"},
    ),
    "bare_unit_row": ("TIME,CH1\nsecond,Volt\n" + rows(), {}),
    "milliseconds_in_a_unit_row": ("t;F\n[ms];[N]\n" + rows("{t:.2f}e3;{x:.4f}"), {}),
    "unit_in_the_name": ("t [ms],force (N)\n" + rows("{t:.2f}e3,{x:.4f}"), {}),
    "name_without_its_unit": (
        "n,t [ms],force [N]\n" + rows("7,{t:.2f}e3,{x:.4f}"),
        {"time_column": "t", "value_column": "force"},
    ),
    "scope_preamble": (
        "Model,SCOPE1\nFirmware,1.14\nSample interval,0.1\n\nTIME,CH1\n" + rows(),
        {},
    ),
    "preamble_and_names_asked_for": (
        "Model,SCOPE1\nt,is not here\nTIME,CH1,CH2\n" + rows("{t:.2f},3,{x:.4f}"),
        {"time_column": "TIME", "value_column": "CH2"},
    ),
    "labview": (
        "LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\nChannels\t1\nSamples\t60\n"
        "X_Value\tForce\tComment\n" + rows("{t:.6f}\t{x:.6f}"),
        {},
    ),
    "names_in_a_comment": ("# made by numpy\n# t force\n" + rows("{t:.18e} {x:.18e}"), {}),
    "echo_of_ros1": (
        "%time,field.header.seq,field.header.frame_id,field.wrench.force.x\n"
        + "".join(
            f"{1700000000000000000 + round(t * 1e9)},1,ft,{x:.4f}\n"
            for t, x in zip(TIMES, FORCES, strict=True)
        ),
        {"value_column": "field.wrench.force.x"},
    ),
    "echo_of_ros2": (
        "".join(
            f"{1700000000 + int(t)},{round(t % 1 * 1e9)},ft,{x:.4f},0.1,0.2,0.0,0.0,0.01\n"
            for t, x in zip(TIMES, FORCES, strict=True)
        ),
        {},
    ),
    "iso_dates": (
        "when,force\n"
        + "".join(
            f"2026-02-28T23:59:{59 + int(t):02d}.{round(t % 1 * 100):02d}Z,{x:.4f}\n"
            for t, x in zip(TIMES, FORCES, strict=True)
            if t < 1.0
        ),
        {},
    ),
    "times_of_day": (
        "when;force\n"
        + "".join(
            f"9:05:{7 + int(t):02d},{round(t % 1 * 1000):03d};{x:.4f}\n".replace(".", ",")
            for t, x in zip(TIMES, FORCES, strict=True)
        ),
        {},
    ),
    "unit_of_the_option": ("t,force\n" + rows("{t:.2f}e3,{x:.4f}"), {"time_unit": "ms"}),
    "sample_rate": (rows("{x:.4f}"), {"sample_rate": 50.0}),
    "sample_rate_with_commas": (
        "Kraft\n" + rows("{x:.4f}").replace(".", ","),
        {"sample_rate": 50.0, "options": CsvOptions(decimal=",")},
    ),
    "ends_in_commas": ("t,force,\n" + rows("{t:.2f},{x:.4f},"), {}),
    "a_column_by_number": (rows("ft,{x:.4f},{t:.2f}"), {"time_column": "3", "value_column": "2"}),
}
AS_IT_IS["sec_and_nanosec"] = (
    "header.stamp.sec,header.stamp.nanosec,header.frame_id,wrench.force.x\n"
    + "".join(
        f"{1700000000 + int(t)},{round(t % 1 * 1e9)},ft,{x:.4f}\n"
        for t, x in zip(TIMES, FORCES, strict=True)
    ),
    {"time_column": "header.stamp.sec"},
)


@pytest.mark.parametrize("case", AS_IT_IS)
def test_a_response_is_read_as_meant(tmp_path, case):
    text, given = AS_IT_IS[case]
    read = read_response(written(tmp_path, text), **given)
    if case == "iso_dates":
        np.testing.assert_allclose(read.record.knots, TIMES[:50], atol=1e-9)
        return
    assert_the_response(read)


def test_what_was_guessed_is_told(tmp_path):
    text = "Messgerät;7\n\nZeit;Kraft\n[ms];[N]\n" + rows("{t:.2f};{x:.4f}").replace(".", ",")
    read = read_response(written(tmp_path, text.replace(",", ",")))
    assert read.notes[:2] == (
        "cells are read as separated by semicolons, with decimal commas",
        "the names are in line 3: 1 line above skipped",
    )
    assert "a row of units is read: ms, N" in read.notes
    assert "times are column Zeit in ms" in read.notes
    assert "values are column Kraft in N" in read.notes
    np.testing.assert_allclose(read.record.knots, 1e-3 * TIMES, atol=1e-12)
    assert not read_response(written(tmp_path, rows(), name="plain.csv")).notes[:-2]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "latin-1", "utf-16", "utf-16-le", "utf-16-be"])
def test_other_encodings_are_read(tmp_path, encoding):
    text = "Zeit;Stärke [N]\n" + rows("{t:.2f};{x:.4f}").replace(".", ",")
    read = read_response(written(tmp_path, text, encoding), value_column="Stärke")
    assert_the_response(read)


def test_decimal_commas_are_read_or_told_to_be_the_matter(tmp_path):
    good = "Zeit;Kraft\n" + rows("{t:.2f};{x:.4f}").replace(".", ",")
    assert_the_response(read_response(written(tmp_path, good)))
    with pytest.raises(FileError, match=r"line 2: column Zeit: '0,00' .*--decimal ','"):
        read_response(written(tmp_path, good), options=CsvOptions(decimal="."))
    with pytest.raises(FileError, match="line 2: has 4 cells, the columns are 2; decimal commas"):
        read_response(written(tmp_path, good.replace(";", ",")))


@pytest.mark.parametrize(
    ("text", "given", "cause"),
    [
        (rows("{x:.4f}"), {}, "values at even times need --sample-rate"),
        ("t,x,F\n(s),(mm),(N)\n" + rows("{t:.2f},4,{x:.4f}"), {}, r"--value-column: F"),
        ("t\tF\n" + rows("{t:.2f}\t{x:.4f}"), {"options": CsvOptions(",")}, "--delimiter tab"),
        (
            "time,force\n" + "".join(f"1700000000{n:02d}0000000,1\n" for n in range(50)),
            {},
            "ns since 1970",
        ),
        ("time,force\n" + rows("{t:.2f}e9,{x:.4f}"), {}, r"years: are they in ns\? .*'t \[ns\]'"),
        ("t [ns],F\n" + rows(), {}, "span 1.18 ns as column .* in ns: are they in s"),
        ("%time,F\n" + rows(), {}, "are they in s"),
        ("t,F\n1700000000000,8\n1700000000020,7\n", {}, "by all appearance, ms since 1970"),
        ("t,F\n1700000000000000,8\n1700000000020000,7\n", {}, "us since 1970: .*--time-unit us"),
        ("t,F\n28.02.2026 23:59:58,8\n28.02.2026 23:59:59,7\n", {}, "line 2: .*dates and times"),
        ("t,F\n0,8 N\n1,4 N\n2,2 N\n", {}, "line 2: .*a unit belongs into the name"),
        ("t;F\n0,1;1.234,5\n0,2;1.034,5\n", {}, "marks between thousands are not read"),
        ("t,F\n0,8\n1,4\n1,3\n2,1\n", {}, "line 4: .*1 stands in line 3, too; --drop-bad"),
        ("t,F\n0,8\n1,4\n0.5,3\n", {}, "line 4: the times must increase: 0.5 is before 1 of"),
        ("t,F\n0,8\n1,\n2,1\n", {}, "line 3: column F: '' is no finite number; --drop-bad"),
        ("a,F\n2026-13-01T00:00:00,1\n2026-13-01T00:00:01,1\n", {}, "line 2: month must be"),
        ("PK\x03\x04......", {}, "as .xlsx workbooks are"),
        ("t,F\n0,\x00\n", {}, "no text"),
        (rows(), {"sample_rate": 50.0}, "holds 2 columns: with --sample-rate name"),
        (rows(), {"value_column": "F"}, "no line names the columns"),
    ],
)
def test_what_cannot_be_read_names_the_cause(tmp_path, text, given, cause):
    with pytest.raises(FileError, match=cause) as error:
        read_response(written(tmp_path, text), **given)
    assert "record.csv" in str(error.value)


def test_options_that_exclude_each_other_are_refused(tmp_path):
    path = written(tmp_path, rows("{x:.4f}"))
    for given in (
        {"sample_rate": 50.0, "time_unit": "ms"},
        {"sample_rate": -1.0},
        {"sample_rate": 50.0, "options": DROP},
        {"time_unit": "hours"},
        {"options": CsvOptions(",", ",")},
    ):
        with pytest.raises(RangeError):
            read_response(path, **given)


def test_bad_rows_are_left_out_and_counted_where_that_is_asked_for(tmp_path):
    lines = ("t,F\n" + rows()).splitlines()
    lines[10:10] = ["0.17,", ",3.0", "0.16,9.0", "0.165,nan", "oops,1", "0.17"]
    read = read_response(written(tmp_path, "\n".join(lines)), options=DROP)
    assert_the_response(read)
    assert read.notes[:3] == (
        "3 rows left out: column F holds no number",
        "2 rows left out: they hold no time",
        "1 row left out: they repeat a time",
    )
    with pytest.raises(FileError, match="no row is left"):
        read_response(written(tmp_path, "t,F\n0,\n1,\n"), options=DROP)


def test_a_response_that_starts_at_zero_is_no_response(tmp_path):
    with pytest.raises(DataError, match=r"record\.csv: x\(0\) must not be zero"):
        read_response(written(tmp_path, "t,F\n0,0\n1,4\n"))


PAIRS = np.round(np.random.default_rng(3).normal(size=(8, 6)), 3)
NAMES = "fx_N,fy_N,tau_Nm,vx,vy,omega"


def pushes_as(tmp_path, names, form=",", factors=(1,) * 6, decimal=".", above="", below=""):
    lines = [form.join(f"{x:.9g}" for x in row / np.array(factors)) for row in PAIRS]
    text = f"{above}{form.join(names.split(','))}\n{below}" + "\n".join(lines).replace(
        ".", decimal
    )
    return written(tmp_path, text, name="pushes.csv")


@pytest.mark.parametrize(
    ("names", "how"),
    [
        (NAMES, {}),
        (NAMES, {"form": ";", "decimal": ","}),
        (NAMES, {"form": "\t"}),
        (NAMES, {"above": "Logger,3\nStarted,2026-01-01\n\n"}),
        ("fx [mN],fy (mN),tau [N mm],vx [mm/s],vy_mm_s,omega [deg/s]", {"factors": "mixed"}),
        (
            "fx,fy,tau,vx,vy,omega",
            {"below": "(mN),(mN),[N*mm],mm/s,mm/s,°/s\n", "factors": "mixed"},
        ),
        ("Fx,Fy,Tz,Vx,Vy,wz", {"below": "N,N,Nm,m/s,m/s,rad/s\n"}),
        (
            "wrench.force.x,wrench.force.y,wrench.torque.z,twist.linear.x,twist.linear.y,"
            "twist.angular.z",
            {},
        ),
    ],
)
def test_pushes_are_read_as_meant(tmp_path, names, how):
    if how.get("factors") == "mixed":
        how = {**how, "factors": (1e-3, 1e-3, 1e-3, 1e-3, 1e-3, np.pi / 180.0)}
    pairs = read_pushes(pushes_as(tmp_path, names, **how)).pairs
    np.testing.assert_allclose(np.hstack([pairs.wrenches, pairs.twists]), PAIRS, rtol=1e-7)


@pytest.mark.parametrize(
    ("names", "cause"),
    [
        (NAMES.replace("tau_Nm", "tau [kg]"), r"column tau \[kg\] is in 'kg'; accepted are Nm"),
        (NAMES.replace("fx_N", "left"), "column fx_N is missing; needed are .*got left, fy_N"),
        (NAMES.replace("fx_N,fy_N", "fx,force_x"), "column fx_N is given twice"),
    ],
)
def test_columns_of_pushes_that_cannot_be_read_are_named(tmp_path, names, cause):
    with pytest.raises(FileError, match=cause):
        read_pushes(pushes_as(tmp_path, names))


def test_bad_rows_of_pushes_are_left_out_where_that_is_asked_for(tmp_path):
    path = pushes_as(tmp_path, NAMES)
    path.write_text(
        path.read_text() + "\n1,2,3,4,5,\n0,0,0,1,1,1\n1,1,1,0,0,0\n1,2\n1,2,3,4,5,x\n"
    )
    read = read_pushes(path, DROP)
    assert len(read.pairs) == len(PAIRS)
    assert read.notes == ("5 rows left out: they are no push",)
    with pytest.raises(FileError, match="line 10: column omega: '' is no finite number"):
        read_pushes(path)

# SPDX-License-Identifier: Apache-2.0
"""fit_decay and compare_decays: from an example or a record to a model file and a table."""

import re
import sys

import numpy as np
import pytest

from limit_surface_ros.decay import examples
from limit_surface_ros.files.decay_file import read_decay_model
from limit_surface_ros.files.response_csv import read_response
from limit_surface_ros.tools import compare_decays, fit_decay


def write_record(path, noise=0.0, header="time,force"):
    times = np.linspace(2.0, 8.0, 241)
    values = 5.0 * np.exp(-0.8 * (times - 2.0)) + noise * np.random.default_rng(0).normal(size=241)
    lines = [header] * bool(header) + [f"{t},{x}" for t, x in zip(times, values, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_an_example_becomes_a_model_whose_error_is_true(tmp_path, capsys):
    output = tmp_path / "f1.yaml"
    assert fit_decay.main(["f1", "--terms", "9", "--method", "esprit", "-o", str(output)]) == 0
    model = read_decay_model(output)
    times = np.linspace(0.0, 6.0, 60001)
    error = np.abs(model.sum(times) - examples.hockey_stick()(times)).max()
    assert error == pytest.approx(model.max_error, rel=0.01)
    # What is proven is hardly more than what was found: then it is what the model states.
    assert error <= model.max_error == model.fit["error_proven"]
    assert model.name == "f1"
    assert model.fit["method"] == "esprit"
    assert output.read_text().startswith("# Made by: fit_decay f1 --terms 9")
    printed = capsys.readouterr()
    for label in ("terms", "error", "optimal", "beyond", "right-most", "time"):
        assert re.search(rf"^{label} ", printed.out, re.MULTILINE)
    assert "esprit" in printed.err


def test_the_delay_system_is_written_with_its_model(tmp_path):
    output = tmp_path / "dde.yaml"
    arguments = ["f1", "--terms", "9", "--method", "dde", "--max-delay", "6", "-o", str(output)]
    assert fit_decay.main(arguments) == 0
    model = read_decay_model(output)
    assert model.system is not None
    value, slope = model.system.characteristic_and_derivative(model.sum.rates)
    assert np.abs(value / slope).max() < 1e-10


def test_a_record_that_is_a_sum_of_exponentials_is_fitted_exactly_at_its_samples(tmp_path, capsys):
    record, times = tmp_path / "record.csv", np.linspace(0.0, 4.0, 201)
    values = 6.0 * np.exp(-1.5 * times) + 2.0 * np.exp(-4.0 * times) * np.cos(9.0 * times)
    record.write_text("\n".join(f"{t},{x}" for t, x in zip(times, values, strict=True)))
    output = tmp_path / "model.yaml"
    arguments = [str(record), "-n", "3", "--method", "esprit", "-o", str(output)]
    assert fit_decay.main(arguments) == 0
    model = read_decay_model(output)
    assert model.max_error < 1e-11
    np.testing.assert_allclose(model.sum.rates, [-1.5, -4.0 + 9.0j], rtol=1e-9)
    printed = capsys.readouterr().out
    assert "at the 201 samples on [0, 4] s" in printed
    assert re.search(r"^between +up to 4\.9\d*e-03 from the straight lines", printed, re.MULTILINE)


@pytest.mark.parametrize("header", ["time,force", ""])
def test_a_record_gives_back_its_rate_from_its_own_onset(tmp_path, header):
    record = write_record(tmp_path / "record.csv", header=header)
    output = tmp_path / "model.yaml"
    assert fit_decay.main([str(record), "--terms", "1", "-o", str(output)]) == 0
    model = read_decay_model(output)
    np.testing.assert_allclose(model.sum.rates, [-0.8], rtol=1e-3)
    assert float(model.sum(0.0)) == pytest.approx(5.0, rel=1e-3)
    assert model.time_span == (0.0, 6.0)


def test_a_column_is_chosen_by_its_name(tmp_path):
    record = tmp_path / "record.csv"
    times = np.linspace(0.0, 4.0, 101)
    rows = [f"{7.0},{np.exp(-2.0 * t)},{t}" for t in times]
    record.write_text("\n".join(["other,force,stamp", *rows]))
    output = tmp_path / "model.yaml"
    chosen = ["--time-column", "stamp", "--value-column", "force"]
    assert fit_decay.main([str(record), "-n", "1", *chosen, "-o", str(output)]) == 0
    np.testing.assert_allclose(read_decay_model(output).sum.rates, [-2.0], rtol=1e-3)


@pytest.mark.parametrize(
    ("text", "extra", "message"),
    [
        ("t,x\n0,1\n1,oops\n", [], "line 3: column x: 'oops' is no finite number\n"),
        (
            "t,x\n0,1\n1,nan\n",
            [],
            "line 3: column x: 'nan' is no finite number; --drop-bad leaves",
        ),
        ("t,x\n0,1\n", [], "holds 1 sample;"),
        ("", [], "holds no rows"),
        ("t,x\n0,0\n1,1\n", [], "x(0) must not be zero"),
        ("t,x\n0,1\n0,0.5\n", [], "times must increase"),
        ("t,x\n0,1\n1,0.5\n", ["--value-column", "y"], "column 'y' is missing; there are t, x"),
        ("t,x\n0,1\n1,0.5\n", ["--end", "5"], "ends at 1 s"),
        ("t,x\n0,1\n1,0.5\n", ["--end", "-5"], "--end"),
        ("t\n0\n1\n", [], "has no column 2"),
        ("t,x\n0,1\n1,1e300\n", [], "line 3: column x: 1e300 is beyond 1e+100"),
        ("t,x\n0,1e-300\n1,1e-301\n", [], "values must be between 1e-100 and 1e+100"),
        ("t [d],x\n0,1\n1,0.5\n", [], "times are in 'd' by the column's name 't [d]'"),
        ("t,x\n0,1\n1," + "1" * 200_000, [], "line 3: is not a row of CSV: field larger"),
    ],
)
def test_a_bad_record_gives_one_line_and_no_file(tmp_path, capsys, text, extra, message):
    record, output = tmp_path / "record.csv", tmp_path / "model.yaml"
    record.write_text(text)
    assert fit_decay.main([str(record), "-n", "1", "-o", str(output), *extra]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not output.exists()


@pytest.mark.parametrize(
    ("name", "unit"), [("t [ms]", 1e-3), ("t (us)", 1e-6), ("stamp_ns", 1e-9), ("t_s", 1.0)]
)
def test_times_are_read_in_the_unit_that_their_column_states(tmp_path, name, unit):
    record = tmp_path / "record.csv"
    rows = [f"{t / unit},{np.exp(-t)}" for t in np.linspace(0.0, 4.0, 41)]
    record.write_text("\n".join([f"{name},x", *rows]))
    assert read_response(record).record.knots[-1] == pytest.approx(4.0)


def test_yaml_is_no_record(tmp_path, capsys):
    contact = tmp_path / "contact.yaml"
    contact.write_text("name: el\n")
    assert fit_decay.main([str(contact), "-n", "1"]) == 2
    assert "accepted are an example, a CSV file" in capsys.readouterr().err


def test_a_sum_that_is_no_decay_model_is_told_before_the_report(tmp_path, capsys):
    output = tmp_path / "f4.yaml"
    chosen = ["--method", "dde", "--max-delay", "6", "--allow-unstable"]
    assert fit_decay.main(["f4", "-n", "5", *chosen, "-o", str(output)]) == 2
    told = capsys.readouterr()
    assert "must decay" in told.err
    assert told.out == ""
    assert not output.exists()


def test_more_terms_than_the_samples_determine_are_refused(tmp_path, capsys):
    record = write_record(tmp_path / "record.csv")
    assert fit_decay.main([str(record), "-n", "1000"]) == 2
    assert "1000 terms need at least 2000 samples on [0, 6] s, there are 241" in (
        capsys.readouterr().err
    )
    assert fit_decay.main([str(record), "-n", "21", "--end", "1"]) == 2
    assert "there are 41" in capsys.readouterr().err


@pytest.mark.parametrize(("growth", "warned"), [(0.0, True), (-0.05, False), (-2.0, False)])
def test_a_response_that_does_not_decay_is_warned_of(tmp_path, capsys, growth, warned):
    record, times = tmp_path / "record.csv", np.linspace(0.0, 6.0, 61)
    record.write_text("\n".join(f"{t},{np.exp(growth * t)}" for t in times))
    assert fit_decay.main([str(record), "-n", "2"]) == 0
    assert ("warning: the fitted sum does not decay" in capsys.readouterr().err) == warned


def write_offset(path, offset, noise=0.0):
    times = np.linspace(0.0, 4.0, 201)
    noisy = noise * np.random.default_rng(1).normal(size=201)
    values = 5.0 * np.exp(-2.0 * times) + offset + noisy
    path.write_text("\n".join(f"{t},{x}" for t, x in zip(times, values, strict=True)))
    return path


@pytest.mark.parametrize(
    ("offset", "noise", "warned"),
    [
        (1.0, 0.0, True),
        (-0.4, 0.0, True),
        (1.0, 0.05, True),
        (0.0, 0.0, False),
        (0.0, 0.05, False),
    ],
)
def test_a_record_that_ends_at_a_constant_is_warned_of(tmp_path, capsys, offset, noise, warned):
    record = write_offset(tmp_path / "record.csv", offset, noise)
    assert fit_decay.main([str(record), "-n", "2", "--method", "esprit"]) == 0
    told = capsys.readouterr().err
    assert ("the record ends at about" in told) == warned
    assert ("--offset auto" in told) == warned


@pytest.mark.parametrize(("given", "expected"), [("auto", 1.0025), ("1.0", 1.0)])
def test_an_offset_is_taken_away_and_kept_with_the_model(tmp_path, given, expected):
    record, output = write_offset(tmp_path / "record.csv", 1.0), tmp_path / "model.yaml"
    arguments = [str(record), "-n", "1", "--method", "esprit", "--offset", given]
    assert fit_decay.main([*arguments, "--start", "0.2", "-o", str(output)]) == 0
    model = read_decay_model(output)
    np.testing.assert_allclose(model.sum.rates, [-2.0], rtol=0.01)
    assert model.fit["offset"] == pytest.approx(expected, abs=1e-3)
    assert model.fit["start"] == 0.2


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("auto", "ends at no constant other than 0"),
        ("x", "--offset must be a number or auto, got 'x'"),
        ("nan", "--offset must be a number or auto"),
    ],
)
def test_an_offset_that_cannot_be_taken_away_is_refused(tmp_path, capsys, given, message):
    record = write_offset(tmp_path / "record.csv", 0.0)
    assert fit_decay.main([str(record), "-n", "1", "--offset", given]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["f1", "-n", "5", "--offset", "1"], "--offset does nothing here: it is for a record"),
        (["nowhere.csv", "-n", "3"], "no such file, and no example has that name"),
        (["f1", "-n", "0"], "terms must be at least 1"),
        (["f4", "-n", "5", "--method", "dde"], "not minimum-phase"),
        (["f1", "-n", "5", "-o", "no/such/folder/f.yaml"], "folder does not exist"),
        (["f1", "-n", "5", "--method", "dde", "--max-delay", "-1"], "max_delay"),
        (["f1", "-n", "5", "--method", "dde", "--max-delay", "1", "--degree", "99"], "0 to 30"),
        (["f1", "-n", "5", "--tail-rate", "1"], "must have a real part below 0"),
        (["f1", "-n", "5", "--tail-rate=-1-2j"], "Im >= 0"),
        (["f1", "-n", "5", "--topic", "/wrench"], "--topic does nothing here: it is for a bag"),
        (["f1", "-n", "5", "--value-column", "x"], "it is for a CSV file"),
        (["f1", "-n", "5", "--max-delay", "3"], "it is for --method dde"),
        (["f1", "-n", "5", "--name", "", "-o", "f.yaml"], "--name must not be empty"),
        (["f1", "-n", "5", "-o", "f.txt"], "must end in .yaml or .yml"),
    ],
)
def test_a_bad_request_says_what_was_wrong(capsys, arguments, message):
    assert fit_decay.main(arguments) == 2
    assert message in capsys.readouterr().err


def test_methods_and_terms_are_compared_in_one_table(capsys):
    arguments = ["f4", "--methods", "dde", "neutral", "esprit", "--terms", "5", "7"]
    assert compare_decays.main(arguments) == 0
    printed = capsys.readouterr().out
    rows = [line.split(" | ") for line in printed.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + 6
    assert [row[2] for row in rows if "dde" in row[0]] == ["refused", "refused"]
    assert "dde: the response is not minimum-phase" in printed
    errors = {(row[0], row[1]): float(row[2]) for row in rows[2:] if row[2] != "refused"}
    assert errors["| esprit", "7"] < errors["| esprit", "5"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["f1", "--terms", "5", "0"], "--terms must be at least 1 each, got 0"),
        (["f1", "--tail-rate", "1"], "must have a real part below 0"),
    ],
)
def test_a_comparison_of_nothing_that_could_be_fitted_is_refused(capsys, arguments, message):
    assert compare_decays.main(arguments) == 2
    told = capsys.readouterr()
    assert message in told.err
    assert told.out == ""


def write_bag(folder, storage="SQLITE3", count=201):
    """Write a relaxing force, its onset at 1 s, on /wrench, and a plain number on /number."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    types = store.types
    wrench_type, number_type = "geometry_msgs/msg/WrenchStamped", "std_msgs/msg/Float64"
    vector, header = types["geometry_msgs/msg/Vector3"], types["std_msgs/msg/Header"]
    plugin = getattr(rosbag2.StoragePlugin, storage)
    with rosbag2.Writer(folder, version=9, storage_plugin=plugin) as writer:
        wrenches = writer.add_connection("/wrench", wrench_type, typestore=store)
        plain = writer.add_connection("/number", number_type, typestore=store)
        for k in range(count):
            nanoseconds = 1_000_000_000_000 + k * 25_000_000
            t = 0.025 * k
            force = 8.0 * np.exp(-1.5 * max(t - 1.0, 0.0))
            stamp = types["builtin_interfaces/msg/Time"](*divmod(nanoseconds, 10**9))
            wrench = types["geometry_msgs/msg/Wrench"](
                vector(force, 0.0, 0.0), vector(0.0, 0.0, 0.0)
            )
            message = types[wrench_type](header(stamp, "tool"), wrench)
            late = nanoseconds + 7_000_000
            writer.write(wrenches, late, store.serialize_cdr(message, wrench_type))
            number = types[number_type](force)
            writer.write(plain, nanoseconds, store.serialize_cdr(number, number_type))
    return folder


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_a_measured_relaxation_in_a_bag_becomes_a_model(tmp_path, storage):
    bag = write_bag(tmp_path / "bag", storage)
    output = tmp_path / "model.yaml"
    chosen = ["--topic", "wrench", "--field", "wrench.force.x", "--start", "1"]
    assert fit_decay.main([str(bag), *chosen, "-n", "1", "-o", str(output)]) == 0
    model = read_decay_model(output)
    np.testing.assert_allclose(model.sum.rates, [-1.5], rtol=2e-3)
    assert float(model.sum(0.0)) == pytest.approx(8.0, rel=1e-3)


def test_the_only_number_of_a_message_needs_no_name(tmp_path):
    bag = write_bag(tmp_path / "bag")
    output = tmp_path / "model.yaml"
    arguments = [str(bag), "--topic", "/number", "--start", "1", "-n", "1", "-o", str(output)]
    assert fit_decay.main(arguments) == 0
    np.testing.assert_allclose(read_decay_model(output).sum.rates, [-1.5], rtol=2e-3)


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ([], "is a bag: say which topic"),
        (["--topic", "/force"], "has no topic /force; there are /number, /wrench"),
        (["--topic", "/wrench"], "hold 6 numbers; name one: wrench.force.x"),
        (["--topic", "/wrench", "--field", "force.x"], "have no number 'force.x'"),
        (["--topic", "/number", "--start", "99"], "--start 99 must"),
        (["--topic", "/number", "--start", "-1"], "--start -1 must"),
    ],
)
def test_a_bag_that_does_not_hold_what_is_asked_says_what_it_holds(
    tmp_path, capsys, extra, message
):
    bag = write_bag(tmp_path / "bag", count=5)
    assert fit_decay.main([str(bag), "-n", "1", *extra]) == 2
    assert message in capsys.readouterr().err


def test_a_folder_that_is_no_bag_is_refused(tmp_path, capsys):
    pytest.importorskip("rosbags")
    assert fit_decay.main([str(tmp_path), "--topic", "/x", "-n", "1"]) == 2
    assert "the folder has no metadata.yaml; accepted are the folder" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["bad.mcap", "bad.db3", "bad/metadata.yaml"])
def test_a_bag_that_is_broken_is_refused_in_one_line(tmp_path, capsys, name):
    pytest.importorskip("rosbags")
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_text("x: [")
    bag = file.parent if file.name == "metadata.yaml" else file
    assert fit_decay.main([str(bag), "--topic", "/x", "-n", "1"]) == 2
    told = capsys.readouterr().err
    assert "cannot be read as a bag" in told
    assert "accepted are the folder of a ROS 2 bag, or an .mcap, .db3 or .bag file" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("program", [fit_decay, compare_decays])
def test_help_teaches_with_examples(program, capsys):
    with pytest.raises(SystemExit) as exit_code:
        program.main(["--help"])
    assert exit_code.value.code == 0
    assert "examples:" in capsys.readouterr().out


def test_without_rosbags_the_extra_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    assert fit_decay.main([str(tmp_path), "--topic", "/x", "-n", "1"]) == 2
    assert "extra 'bags'" in capsys.readouterr().err


def test_the_record_is_never_overwritten(tmp_path, capsys):
    record = write_record(tmp_path / "record.csv").rename(tmp_path / "record.yaml")
    before = record.read_bytes()
    assert fit_decay.main([str(record), "-n", "2", "-o", str(record)]) == 2
    assert "is the input" in capsys.readouterr().err
    assert record.read_bytes() == before


def test_the_delay_system_is_shown_when_asked_for(capsys):
    chosen = ["--method", "dde", "--max-delay", "6", "--degree", "5", "--show-system"]
    assert fit_decay.main(["f1", "-n", "5", *chosen]) == 0
    printed = capsys.readouterr().out
    assert "  -1 1/s at 0 s\n  +1 1/s at 1 s\n" in printed
    assert "pieces as polynomials in t, coefficients of t^5, t^4, t^3, t^2, t^1, 1:" in printed
    assert "  l^7 =\n    + (-1 l^6 - " in printed
    assert "    + exp(-6 l) (" in printed
    assert re.search(r"^  -2\.0\d+ \+0\.5\d+i 1/s$", printed, re.MULTILINE)
    assert fit_decay.main(["f1", "-n", "5", "--show-system"]) == 2
    assert "--show-system does nothing here" in capsys.readouterr().err


def test_outliers_noise_and_terms_are_told_and_written(tmp_path, capsys):
    record, times = tmp_path / "record.csv", np.linspace(0.0, 5.0, 501)
    values = 5.0 * np.exp(-2.0 * times) + 0.02 * np.random.default_rng(2).normal(size=501)
    values[[60, 200, 333]] += [4.0, -3.0, 3.5]
    record.write_text("\n".join(f"{t},{x}" for t, x in zip(times, values, strict=True)))
    output = tmp_path / "model.yaml"
    assert fit_decay.main([str(record), "-n", "auto", "-o", str(output)]) == 0
    printed = capsys.readouterr().out
    assert "3 samples left out, at 0.6, 2, 3.33 s" in printed
    assert "BIC above the least: 1 term 0.0, 2 terms" in printed
    assert re.search(r"^assumed +after 5 s the response stays within", printed, re.MULTILINE)
    model = read_decay_model(output)
    assert model.norm == "2"
    assert model.noise == pytest.approx(0.02, rel=0.15)
    assert model.max_error <= model.fit["error_between"] < 2.0 * model.max_error
    assert model.fit["outlier_times"] == [0.6, 2.0, 3.33]
    assert model.tail.bound < 0.001 < model.tail.envelope


def test_a_free_offset_is_fitted_as_a_constant(tmp_path, capsys):
    record = write_offset(tmp_path / "record.csv", 1.5, 0.01)
    output = tmp_path / "model.yaml"
    assert fit_decay.main([str(record), "-n", "1", "--offset", "free", "-o", str(output)]) == 0
    assert read_decay_model(output).sum.constant == pytest.approx(1.5, abs=0.01)
    assert re.search(r"^constant +1\.\d+, to which the sum decays", capsys.readouterr().out, re.M)
    refused = ["-n", "1", "--offset", "free", "--method", "esprit"]
    assert fit_decay.main([str(record), *refused]) == 2
    assert "--offset free is for" in capsys.readouterr().err


def test_a_growing_record_is_refused(tmp_path, capsys):
    record, times = tmp_path / "record.csv", np.linspace(0.0, 6.0, 61)
    record.write_text("\n".join(f"{t},{np.exp(0.3 * t)}" for t in times))
    assert fit_decay.main([str(record), "-n", "2"]) == 2
    assert "the response grows" in capsys.readouterr().err

"""What the commands share: JSON, exit codes, the list of methods, and NumPy files."""

from __future__ import annotations

import io
import json
import sys
import tracemalloc
import warnings
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import solvers
from solvers import METHODS, Pose, register
from solvers.cli import arrays
from solvers.cli.command import main
from solvers.scenes.rooms import room
from tests.solvers.cli.calls import call

pytestmark = pytest.mark.native


def npy(values) -> bytes:
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def npz(**values) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **values)
    return file.getvalue()


@pytest.fixture
def files(tmp_path):
    scene = room("noise", seed=40)
    (tmp_path / "a.npy").write_bytes(npy(scene.source))
    (tmp_path / "b.npz").write_bytes(npz(points=scene.target, times=np.arange(3)))
    (tmp_path / "far.npy").write_bytes(npy(scene.target + 1e4))
    return tmp_path


def test_json_holds_what_register_finds(files, capsys):
    scene = room("noise", seed=40)
    result = register(scene.source, scene.target, "gicp", start=Pose.from_angle(0.2, (0.1, 0.0)))
    start = f"--start={float(np.degrees(0.2))},0.1,0"
    code, out, err = call(capsys, "register", files / "a.npy", files / "b.npz", "--method", "gicp", start, "--json")
    report = json.loads(out)
    assert (code, err) == (0, "")
    assert (report["method"], report["status"], report["steps"]) == ("gicp", result.status.label, result.steps)
    np.testing.assert_allclose(report["matrix"], result.matrix, atol=1e-9)
    assert report["converged"] is True
    assert report["lower"] is None
    assert "NumPy array 'points'" in report["target"]


def test_the_command_may_be_left_out(files, capsys):
    assert call(capsys, files / "a.npy", files / "b.npz") == call(capsys, "register", files / "a.npy", files / "b.npz")


@pytest.mark.parametrize(
    ("target", "further", "status", "overlaps"),
    [
        ("b.npz", ["--max-steps", "1"], "capped", True),
        ("far.npy", ["--options", "gate=1.0"], "degenerate", False),
    ],
)
def test_an_answer_that_is_not_to_be_trusted_is_exit_code_3(files, capsys, target, further, status, overlaps):
    """The report gives a residual only if the clouds overlap."""
    code, out, _ = call(capsys, files / "a.npy", files / target, *further, "--json")
    report = json.loads(out)
    assert (code, report["status"]) == (3, status)
    assert (report["residual_rms"] is not None) == (report["overlap"] > 0.0) == overlaps


@pytest.mark.parametrize(("method", "status"), [("flow", "finished"), ("ndt", "stalled")])
def test_a_run_is_trusted_where_it_ends_of_its_own_accord(files, capsys, method, status):
    code, out, _ = call(capsys, files / "a.npy", files / "b.npz", "--method", method, "--json")
    assert (code, json.loads(out)["status"]) == (0, status)


def test_an_end_with_nothing_near_is_not_trusted(files, capsys):
    """The method converges, but no source point ends within reach of the target."""
    code, out, _ = call(capsys, files / "a.npy", files / "b.npz", "--reach", "1e-9", "--json")
    assert (code, json.loads(out)["status"], json.loads(out)["overlap"]) == (3, "converged", 0.0)


def test_the_methods_are_listed_with_their_options(capsys):
    code, out, _ = call(capsys, "methods")
    assert (code, [line.split()[0] for line in out.splitlines()]) == (0, list(METHODS))
    for line, name in zip(out.splitlines(), METHODS, strict=True):
        dims = METHODS[name].dims
        assert line[24:36].strip() == ("any" if dims is None else " or ".join(f"{d}-D" for d in dims))
        assert line[36:] == METHODS[name].summary
    code, out, _ = call(capsys, "methods", "icp", "kabsch", "--json")
    icp, kabsch = json.loads(out)
    assert icp["options"]["gate"] == "inf"  # JSON cannot express infinity as a number
    assert icp["options"]["tuning"] is None
    assert icp["source"] == "Besl & McKay 1992"
    assert kabsch["paired"] is True
    code, out, _ = call(capsys, "methods", "icp")
    assert "gate=inf" in out
    code, _, err = call(capsys, "methods", "ipc")
    assert code == 2
    assert err.startswith("python -m solvers: METHOD: 'ipc' is unknown, did you mean 'icp'?")


def test_the_benchmark_as_json_is_its_table(capsys):
    code, out, _ = call(capsys, "benchmark", "--setting", "clean", "--seeds", 2, "--only", "gicp", "--json")
    (result,) = json.loads(out)
    assert (code, result["setting"], result["seeds"]) == (0, "clean", 2)
    (line,) = result["methods"]
    assert line["method"] == "gicp"
    assert sum(line["stops"].values()) == 2
    assert 0 <= line["close"] <= line["turned"] <= 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--seeds", "0"], "--seeds: must be at least 1, got 0"),
        (["--seeds", "-1"], "--seeds: must be at least 1, got -1"),
        (["--max-steps", "-1"], "--max-steps: must be at least 0, got -1"),
        (["--only", "ipc"], "--only: 'ipc' is unknown, did you mean 'icp'?"),
        (["--only", "kabsch"], "--only: 'kabsch' does not race, because it needs pairs and the race has none;"),
    ],
)
def test_the_benchmark_names_the_option_that_is_wrong(capsys, words, message):
    code, out, err = call(capsys, "benchmark", "--setting", "clean", *words)
    assert (code, out) == (2, "")
    assert err.startswith(f"python -m solvers: {message}")


@pytest.mark.parametrize(("value", "words"), [("x", "'x'"), ("1.5", "'1.5'"), ("9" * 5000, f"'{'9' * 39}…'")])
def test_what_is_no_whole_number_is_told_and_shortened(capsys, value, words):
    """5,000 digits are more than Python converts."""
    with pytest.raises(SystemExit) as end:
        main(["benchmark", "--seeds", value])
    assert end.value.code == 2
    assert capsys.readouterr().err.endswith(f"error: argument --seeds: {words} is not a whole number\n")


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_the_version_is_the_package_s(capsys, option):
    with pytest.raises(SystemExit) as end:
        main([option])
    assert (end.value.code, capsys.readouterr().out) == (0, f"registration-ladder {solvers.__version__}\n")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "-V, --version" in capsys.readouterr().out


@pytest.mark.parametrize(("wrong", "meant"), [("methodss", "methods"), ("bench", "benchmark"), ("regster", "register")])
def test_a_misspelt_command_leads_to_the_right_one(capsys, monkeypatch, wrong, meant):
    monkeypatch.setattr("sys.argv", ["/usr/bin/registration-ladder", wrong])
    message = f"registration-ladder: '{wrong}' is neither a command nor a file, did you mean '{meant}'?\n"
    assert call(capsys, wrong) == (2, "", message)


def test_a_word_alone_is_no_registration(capsys):
    message = "python -m solvers: 'frobnicate' is neither a command nor a file; the commands are register, benchmark,"
    code, _, err = call(capsys, "frobnicate")
    assert code == 2
    assert err.startswith(message)


def test_an_option_before_the_files_is_no_misspelt_command(files, capsys):
    code, _, _ = call(capsys, "--method", "gicp", files / "a.npy", files / "b.npz")
    assert code == 0


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("words", "bars"),
    [
        (["register", "a.npy", "b.npz", "--max-steps", "4"], ["icp", "/4"]),
        (["benchmark", "--setting", "clean", "--seeds", "1", "--only", "icp", "gicp"], ["clean", " 0/2", " 1/2"]),
    ],
)
def test_progress_is_shown_on_a_terminal_and_cleared(files, monkeypatch, words, bars):
    monkeypatch.chdir(files)
    monkeypatch.setattr("sys.stderr", Terminal())
    main(words)
    text = sys.stderr.getvalue()
    assert all(bar in text for bar in bars)
    assert text.endswith("\r\033[K")


def test_drawing_is_refused_before_anything_is_computed(files, capsys, monkeypatch):
    """Missing matplotlib is reported at once, not after a long run."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr("solvers.cli.register.register", None)
    monkeypatch.setattr("solvers.cli.drive.prepare", None)
    message = "python -m solvers: --out: drawing needs matplotlib: pip install matplotlib\n"
    for words in (["register", files / "a.npy", files / "b.npz"], ["drive", "telecom-loop"]):
        assert call(capsys, *words, "--out", files / "drawn.svg") == (2, "", message)


@pytest.mark.parametrize(
    "values",
    [
        np.array([[0.0, 1.0], [2.0, 3.0]]),
        np.array([[0, 1, 5], [2, 3, 6]], dtype=np.int16),
        np.asfortranarray(np.arange(8.0, dtype=np.float32).reshape(4, 2)),
        np.array([[0.0, 1.0]], dtype=">f8"),
    ],
)
def test_numpy_s_files_give_their_rows(values):
    for data in (npy(values), npz(points=values), npz(anything=values)):
        np.testing.assert_array_equal(arrays.read(data).points, values)


@pytest.mark.parametrize("shape", [(4,), (2, 2)])
def test_records_give_their_x_y_and_z(shape):
    """As ROS's point clouds become arrays, also such that keep the laser's rows; what else they hold is left out."""
    records = np.zeros(shape, dtype=[("y", "<f4"), ("x", "<f8"), ("ring", "<u2"), ("z", "<f4"), ("name", "S3")])
    for axis, first in (("x", 0.0), ("y", 10.0), ("z", 20.0)):
        records[axis] = first + np.arange(4.0).reshape(shape)
    expected = np.arange(4.0)[:, None] + [0.0, 10.0, 20.0]
    np.testing.assert_array_equal(arrays.read(npy(records)).points, expected)
    planar = records[["x", "y"]].astype([("x", ">f8"), ("y", ">f8")])
    np.testing.assert_array_equal(arrays.read(npz(points=planar)).points, expected[:, :2])


def test_rows_that_are_not_finite_are_left_out_and_told():
    result = arrays.read(npy(np.array([[0.0, 1.0], [np.nan, 2.0], [3.0, 4.0]])))
    assert result.points.tolist() == [[0.0, 1.0], [3.0, 4.0]]
    assert result.notices == ("1 row with NaN or infinity left out",)
    assert result.gaps == 1


def test_what_float64_cannot_hold_is_left_out_without_a_warning():
    values = np.array([["1e4000", "1"], ["3", "4"]]).astype(np.longdouble)
    with warnings.catch_warnings(action="error"):
        assert arrays.read(npy(values)).points.tolist() == [[3.0, 4.0]]


HEADER = "{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}"


def array_bytes(kind: str, shape: str, data: bytes = b"") -> bytes:
    return with_header(HEADER.format(kind, shape), data)


def with_header(header: str, data: bytes = b"") -> bytes:
    text = header.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + data


def flip(data: bytes, start: int, stop: int) -> bytes:
    return data[:start] + bytes(255 - byte for byte in data[start:stop]) + data[stop:]


def pack(compression: int) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        archive.writestr("points.npy", npy(np.eye(2)))
    return file.getvalue()


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (npy(np.zeros(4)), r"of shape \(4,\); expected \(n, 2\) or \(n, 3\)"),
        (npy(np.zeros((3, 4))), r"of shape \(3, 4\)"),
        (npy(np.array([["a", "b"]])), "expected numbers"),
        (npy(np.full((2, 2), np.nan)), "contains no points"),
        (npy(np.zeros((2, 2)))[:-3], "the header says"),
        (array_bytes("<f8", "(1000000000, 2)"), "the header says"),
        (array_bytes("|O", "(2, 2)", b"\x80" * 32), "expected numbers"),
        (npy(np.zeros(3, dtype=[("x", "<f4"), ("z", "<f4")])), "expected numbers, or records with numbers x and y"),
        (npy(np.zeros(3, dtype=[("x", "<f4", (2,)), ("y", "<f4")])), "records with numbers x and y"),
        (npy(np.zeros(3, dtype=[("x", "<f4"), ("y", "<f4")]))[:-4], "the header says"),
        (npy(np.zeros(0, dtype=[("x", "<f4"), ("y", "<f4")])), "contains no points"),
        (b"\x93NUMPY\x01\x00\x05\x00nope\n", "a broken NumPy array"),
        (b"\x93NUMPY", "a broken NumPy array"),
        (b"\x93NUMPY\x03\x00", r"format version \(3, 0\); expected \(1, 0\) or \(2, 0\)"),
        (with_header("{'descr': (("), "^a broken NumPy array: its header cannot be read$"),
        (with_header("{[]: 1}"), "its header cannot be read"),
        (with_header("{b'descr': 1, 'shape': 2}"), "its header cannot be read"),
        (with_header("{'descr': (), 'fortran_order': False, 'shape': (1, 2)}"), "its header cannot be read"),
        (with_header("(" * 9000), "its header cannot be read"),
        (with_header(" " * 20_000), "its header cannot be read"),
        (array_bytes("<f8,,", "(1L, 2L)"), "its header cannot be read"),
        (array_bytes("<f8", "(-1, -2)", bytes(16)), r"of shape \(-1, -2\)"),
        (array_bytes("<f8", f"({10**30}, 0)"), "of shape"),
        (npz(a=np.zeros((2, 2)), b=np.zeros((2, 2))), "expected one array or one called points, got: 'a', 'b'"),
        (npz(points=np.zeros((2, 2)))[:-30], "a broken archive"),
        (b"PK\x03\x04", "a broken archive"),
        (flip(npz(points=np.arange(80.0).reshape(40, 2)), 60, 120), "a broken archive of NumPy arrays: Error -3"),
        (pack(zipfile.ZIP_LZMA), "'points.npy' has a compression that NumPy never writes"),
        (pack(zipfile.ZIP_BZIP2), "'points.npy' has a compression that NumPy never writes"),
        (npz(**{"a\nb": np.eye(2), "c": np.eye(2)}), r"got: 'a\\nb', 'c'"),
    ],
)
def test_what_is_wrong_with_such_a_file_is_said(data, message):
    with pytest.raises(ValueError, match=message):
        arrays.read(data)


def test_an_array_of_python_2_is_read_without_a_warning():
    with warnings.catch_warnings(action="error"):
        assert arrays.read(array_bytes("<f8", "(1L, 2L)", bytes(16))).points.tolist() == [[0.0, 0.0]]


WHOLE = np.arange(8.0).reshape(4, 2)


@pytest.mark.parametrize(
    "whole", [npy(WHOLE), npz(points=WHOLE), pack(zipfile.ZIP_STORED)], ids=["npy", "compressed", "stored"]
)
@given(data=st.data())
@settings(max_examples=200, deadline=None)
def test_damage_is_an_array_or_the_one_error(whole, data):
    """Bytes cut, replaced and inserted anywhere, even a header's own characters, cause no warning and no second
    line."""
    buffer = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(buffer)) | st.integers(8, 70))  # where NumPy's header is
        end = data.draw(st.integers(at, min(len(buffer), at + 4)))
        buffer[at:end] = data.draw(st.binary(max_size=4) | st.text("[](){}',:<fiL129 \n", max_size=4).map(str.encode))
    result, error = outcome(bytes(buffer))
    if result is None:
        assert type(error) is ValueError
        assert len(str(error).splitlines()) == 1
    else:
        assert result.points.shape[1] in (2, 3)
        assert np.isfinite(result.points).all()


def outcome(data: bytes):
    """The cloud that was read and None, or None and the error."""
    with warnings.catch_warnings(action="error"):
        try:
            return arrays.read(data), None
        except ValueError as error:
            return None, error


def test_an_archive_that_unpacks_to_gigabytes_is_refused_before_it_does():
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("points.npy", "w") as entry:
        entry.write(array_bytes("<f8", "(2000000, 2)"))
        for _ in range(32):
            entry.write(bytes(1_000_000))
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="unpacks to more than the limit of 24 MB"):
            arrays.read(file.getvalue())
        assert tracemalloc.get_traced_memory()[1] < 2_000_000
    finally:
        tracemalloc.stop()

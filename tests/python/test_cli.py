"""The command line: exit statuses, one line on stderr, one object on stdout, and how fast it stops."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sarfocus
from reference.histories import history
from sarfocus import experiments
from sarfocus.cli import main
from sarfocus.io import Image, read, write

COMMANDS = ("demo", "info", "form", "autofocus", "measure", "simulate", "reproduce", "report", "bench")
TARGETS = ((0.0, 0.0, 0.0), (4.0, -5.0, 0.0), (-6.0, 3.0, 0.0))


@pytest.fixture
def run(capfd):
    """Run the command line in this process: status, stdout, stderr."""

    def call(*arguments):
        status = main([str(a) for a in arguments])
        captured = capfd.readouterr()
        return status, captured.out, captured.err

    return call


@pytest.fixture
def recorded(tmp_path):
    """A phase history on disk."""
    path = tmp_path / "echo.npz"
    write(path, history(TARGETS, seed=1))
    return path


@pytest.fixture
def formed(tmp_path):
    """An image on disk: one bright point on weak noise."""
    generator = np.random.default_rng(2)
    shape = (128, 128)
    data = 0.01 * (generator.standard_normal(shape) + 1j * generator.standard_normal(shape))
    azimuth, across = np.arange(shape[0])[:, None] - 64, np.arange(shape[1])[None, :] - 60
    data += np.sinc(azimuth / 2.0) * np.sinc(across / 2.0)
    path = tmp_path / "image.npz"
    write(path, Image(data.astype(np.complex64), azimuth_spacing=0.5, range_spacing=0.5))
    return path


def assert_refused(result, *says):
    status, out, err = result
    assert status == 2, err
    assert out == ""
    assert err.count("\n") == 1 and err.endswith("\n"), err
    assert err.startswith("sarfocus: ")
    for text in says:
        assert text in err


def test_help_names_every_command(run):
    status, out, err = run("--help")
    assert status == 0 and err == ""
    assert all(name in out for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_and_json(run, name):
    status, out, _ = run(name, "--help")
    assert status == 0
    assert "--json" in out


def test_version(run):
    assert run("--version")[:2] == (0, f"sarfocus {sarfocus.__version__}\n")


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("nonsense",),
        ("form",),
        ("form", "x.npz"),
        ("form", "x.npz", "-o"),
        ("form", "x.npz", "-o", "y.npz", "--centre", "1,2"),
        ("form", "x.npz", "-o", "y.npz", "--size", "a,b"),
        ("info", "x.npz", "--nonsense"),
        ("measure", "x.npz", "--at", "1,2,3"),
        ("autofocus", "x.npz", "-o", "y.npz", "--method", "magic"),
        ("reproduce", "nonsense"),
        ("simulate", "nonsense", "-o", "y.npz"),
        ("info", "x.npz", "--threads", "two"),
    ],
)
def test_wrong_usage(run, arguments):
    assert_refused(run(*arguments))


def test_unknown_experiment_names_the_known_ones(run):
    assert_refused(run("reproduce", "xie2023-table9"), *experiments.EXPERIMENTS)


def test_info(run, recorded, formed):
    status, out, err = run("info", recorded, "--json")
    assert status == 0 and err == ""
    found = json.loads(out)
    assert found["kind"] == "phase_history"
    assert found["shape"] == [96, 128]
    assert found["trajectory"] is True
    assert run("info", recorded)[0] == 0
    assert json.loads(run("info", formed, "--json")[1])["kind"] == "image"


def test_info_predicts_every_method_that_fits(run, recorded, formed):
    status, out, _ = run("info", recorded, "--size", "10,20", "--spacing", "0.5", "--json")
    found = json.loads(out)
    assert status == 0
    assert found["formed_on"]["shape"] == [20, 40]
    assert [row["method"] for row in found["costs"]] == ["exact", "ffbp", "gpga"]
    found = json.loads(run("info", formed, "--json")[1])
    assert [row["method"] for row in found["costs"]] == ["auto", *sarfocus.method_names(strip=False)]
    assert all(row["seconds"] > 0 and row["memory"] > 0 and row["fits"] for row in found["costs"])
    assert "adaptive_pga" in run("info", formed)[1]


def test_info_warns_of_memory_that_is_not_free(run, formed, monkeypatch):
    monkeypatch.setattr("sarfocus.cost.available_memory", lambda: 1 << 10)
    monkeypatch.setattr("sarfocus.cli.forecast.available_memory", lambda: 1 << 10)
    assert "GiB that are free" in run("info", formed)[1]
    assert not any(row["fits"] for row in json.loads(run("info", formed, "--json")[1])["costs"])


def test_a_phase_history_without_trajectory_is_described(run, tmp_path):
    held = history(TARGETS)
    held.positions = None
    write(tmp_path / "still.npz", held)
    assert json.loads(run("info", tmp_path / "still.npz", "--json")[1])["costs"] == []


def test_a_long_run_is_announced_in_one_line(run, recorded, formed, tmp_path, monkeypatch):
    monkeypatch.setattr("sarfocus.cli.forecast.LONG", 0.0)
    monkeypatch.setattr("sarfocus.cli.forecast.LEAST_SAMPLES", 0)
    monkeypatch.setattr("sarfocus.cli.forecast.LEAST_PIXEL_PULSES", 0)
    for arguments in (("form", recorded), ("autofocus", recorded), ("autofocus", formed, "--method", "pga")):
        status, _, err = run(*arguments, "-o", tmp_path / "out.npz")
        assert status == 0
        assert err.count("\n") == 1 and "GiB beyond input and output" in err


def test_form(run, recorded, tmp_path):
    status, out, err = run("form", recorded, "-o", tmp_path / "image.h5", "--size", "16,18", "--spacing", "0.25", "--json")
    assert status == 0, err
    assert err == ""
    assert json.loads(out)["shape"] == [64, 72]
    image = read(tmp_path / "image.h5")
    peak = np.unravel_index(np.argmax(np.abs(image.data)), image.data.shape)
    nearest = min(np.linalg.norm(np.subtract(image.grid.position(*peak), target)) for target in TARGETS)
    assert nearest < 0.25, "the brightest pixel lies within one pixel of a target"
    status, out, err = run("form", recorded, "-o", tmp_path / "image.npz")
    assert status == 0 and err == ""
    assert "image.npz" in out


def test_measure(run, formed):
    status, out, err = run("measure", formed, "--json")
    assert status == 0 and err == ""
    point = json.loads(out)["points"][0]
    assert abs(point["azimuth"] - 64) < 0.05 and abs(point["range"] - 60) < 0.05, "the point is 40 dB over the noise"
    assert point["irw_azimuth"] == pytest.approx(2 * 0.886, rel=0.02), "a sinc of two pixels; the noise is at 1 % of the peak"
    at = json.loads(run("measure", formed, "--at", "63,61", "--json")[1])["points"]
    assert len(at) == 1 and abs(at[0]["azimuth"] - 64) < 0.05
    assert "verdict" in run("measure", formed)[1]


def test_autofocus_of_an_image_and_report(run, formed, tmp_path):
    status, out, err = run("autofocus", formed, "-o", tmp_path / "focused.h5", "--json")
    assert status == 0, err
    trials = json.loads(out)["diagnostics"]["trials"]
    assert [trial["method"] for trial in trials] == sarfocus.method_names(strip=False)
    assert all(trial["reason"] for trial in trials)
    assert {"before", "phase_error", "phase_std", "points"} <= read(tmp_path / "focused.h5").arrays.keys()
    status, out, err = run("report", tmp_path / "focused.h5", "-o", tmp_path / "page.html", "--json")
    assert status == 0 and err == "", err
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("<html") == 1
    assert "http" not in page, "the page needs nothing from elsewhere"


def test_autofocus_of_a_phase_history(run, recorded, tmp_path):
    status, out, err = run("autofocus", recorded, "-o", tmp_path / "focused.npz", "--spacing", "0.2", "--no-before", "--json")
    assert status == 0, err
    assert json.loads(out)["method"] == "gpga"
    focused = read(tmp_path / "focused.npz")
    assert focused.arrays["phase_error"].shape == (96,)
    assert "before" not in focused.arrays


def test_simulate_is_seeded(run, tmp_path, monkeypatch):
    monkeypatch.setattr("sarfocus.scenes.CLUTTER_PER_CELL", 0.02)  # for speed
    for name in ("a", "b"):
        assert run("simulate", "spotlight", "-o", tmp_path / f"{name}.h5", "--seed", "3", "--json")[0] == 0
    first, second = (read(tmp_path / f"{name}.h5") for name in "ab")
    np.testing.assert_array_equal(first.data, second.data)
    assert len(first.metadata["truth"]["phase_error"]) == len(first.data)


def test_autofocus_of_a_strip(run, tmp_path, monkeypatch):
    """The geometry in the file chooses the method; a report of the result knows what the simulation knew."""
    for name, value in {"N_AZIMUTH": 1024, "N_RANGE": 64, "RANGE_START": 3000.0, "N_POINT": 16, "BUILDINGS": ((0.3, 0.5),)}.items():
        monkeypatch.setattr(f"sarfocus.strip_scene.{name}", value)
    status, out, err = run("simulate", "strip", "-o", tmp_path / "strip.h5", "--motion-error", "0.02", "--json")
    assert status == 0, err
    assert json.loads(out)["stripmap"]["prf"] == 360.0
    status, out, err = run("autofocus", tmp_path / "strip.h5", "-o", tmp_path / "focused.h5", "--json")
    assert status == 0, err
    found = json.loads(out)
    assert found["method"] in ("spga_linear", "adaptive_pga") and found["status"] == "converged", "the two that keep the linear phase"
    seams = found["diagnostics"]["strip"]["seams"]
    assert len(seams["first"]) == len(seams["residual"]) > 10
    assert (
        json.loads(run("autofocus", tmp_path / "strip.h5", "-o", tmp_path / "b.npz", "--method", "spga", "--json")[1])["method"] == "spga"
    )
    status, out, err = run("report", tmp_path / "focused.h5", "-o", tmp_path / "page.html", "--json")
    assert status == 0, err
    assert "Displacement of targets (m), RMS" in [item["name"] for item in json.loads(out)["figures"]]


def test_strip_methods_need_the_geometry(run, formed, recorded, tmp_path):
    for method in ("spga", "spga_linear"):
        assert_refused(run("autofocus", formed, "-o", tmp_path / "x.npz", "--method", method), "geometry", "pga")
        assert_refused(run("autofocus", recorded, "-o", tmp_path / "x.npz", "--method", method), "phase history")


def test_demo_of_an_unknown_scene(run, tmp_path):
    assert_refused(run("demo", "-o", tmp_path / "d", "--scene", "moon"), "strip, spotlight")
    assert not (tmp_path / "d").exists()


# The bad input of the issue, through the command line.


def test_missing_file(run, tmp_path):
    for command in ("info", "measure"):
        assert_refused(run(command, tmp_path / "nothing.npz"), "nothing.npz", "no such file")
    assert_refused(run("form", tmp_path / "nothing.mat", "-o", tmp_path / "x.npz"), "nothing.mat", "no such file")


def test_truncated_mat(run, tmp_path):
    (tmp_path / "cut.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\x0f\x00\x00\x00\x10\x00")
    assert_refused(run("form", tmp_path / "cut.mat", "-o", tmp_path / "x.npz"), "cut.mat")


@pytest.mark.parametrize("dtype", [np.complex128, np.float32, np.int16])
def test_wrong_dtype(run, tmp_path, dtype):
    np.save(tmp_path / "x.npy", np.ones((32, 32), dtype))
    assert_refused(run("autofocus", tmp_path / "x.npy", "-o", tmp_path / "y.npy"), "complex64", np.dtype(dtype).name)


def test_nan(run, tmp_path):
    data = np.ones((32, 32), np.complex64)
    data[5, 7] = np.nan
    np.save(tmp_path / "x.npy", data)
    assert_refused(run("measure", tmp_path / "x.npy"), "[5, 7]")


def test_shapes_that_disagree(run, recorded, tmp_path):
    with np.load(recorded) as archive:
        fields = dict(archive)
    np.savez(tmp_path / "bad.npz", **(fields | {"positions": fields["positions"][:-1]}))
    assert_refused(run("form", tmp_path / "bad.npz", "-o", tmp_path / "x.npz"), "positions", "(96, 3)", "(95, 3)")


def test_zero_size(run, tmp_path):
    np.save(tmp_path / "x.npy", np.zeros((0, 5), np.complex64))
    assert_refused(run("autofocus", tmp_path / "x.npy", "-o", tmp_path / "y.npy"), "size zero")


@pytest.mark.parametrize("command", ["measure", "autofocus"])
def test_all_zero_image(run, tmp_path, command):
    np.save(tmp_path / "x.npy", np.zeros((64, 64), np.complex64))
    arguments = [command, tmp_path / "x.npy", *(["-o", tmp_path / "y.npy"] if command == "autofocus" else [])]
    assert_refused(run(*arguments), "zero")
    assert not (tmp_path / "y.npy").exists()


def test_grid_behind_the_radar(run, recorded, tmp_path):
    assert_refused(run("form", recorded, "-o", tmp_path / "x.npz", "--centre=-2000,0,0"), "behind")


def test_grid_beyond_the_recorded_ranges(run, recorded, tmp_path):
    assert_refused(run("form", recorded, "-o", tmp_path / "x.npz", "--centre", "5000,0,0"), "range")


def test_no_memory_for_the_image(run, recorded, tmp_path):
    assert_refused(run("form", recorded, "-o", tmp_path / "x.npz", "--size", "900", "--spacing", "0.001"), "GiB")
    assert_refused(run("form", recorded, "-o", tmp_path / "x.npz", "--size", "1e12", "--spacing", "0.01"), "pixels")


@pytest.mark.parametrize("name", ["x.tif", "x", "nowhere/x.npz"])
def test_output_is_checked_before_anything_is_computed(run, recorded, tmp_path, name):
    started = time.perf_counter()
    assert_refused(run("form", recorded, "-o", tmp_path / name, "--size", "60", "--spacing", "0.005"))
    assert time.perf_counter() - started < 5.0, "forming that image takes longer"


def test_wrong_kind_of_input(run, recorded, formed, tmp_path):
    assert_refused(run("form", formed, "-o", tmp_path / "x.npz"), "phase history")
    assert_refused(run("measure", recorded), "image")
    assert_refused(run("autofocus", recorded, "-o", tmp_path / "x.npz", "--method", "pga"), "pga works on an image")
    assert_refused(run("autofocus", formed, "-o", tmp_path / "x.npz", "--method", "gpga"), "phase history")
    assert_refused(run("report", recorded, "-o", tmp_path / "x.html"), "result")


def test_errors_with_json_are_one_object_too(run, tmp_path):
    status, out, err = run("info", tmp_path / "nothing.npz", "--json")
    assert status == 2
    assert err.count("\n") == 1
    assert json.loads(out)["exit_status"] == 2


def test_failure_inside_has_status_one(run, formed, monkeypatch):
    def broken(*_):
        raise RuntimeError("wheel came off")

    monkeypatch.setattr("sarfocus.measurement.whole_image", broken)
    status, out, err = run("measure", formed)
    assert status == 1 and out == ""
    assert "wheel came off" in err.splitlines()[-1]


def start(*arguments):
    """Start the command line in a process of its own."""
    package = Path(sarfocus.__file__).resolve().parents[1]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(package), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-m", "sarfocus", *(str(a) for a in arguments)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def processor_seconds(process):
    """Processor time the process has used, s [proc(5), fields 14 and 15 of stat]."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_interrupt_stops_within_a_second(recorded, tmp_path):
    """In the middle of an image that takes minutes: the imports are over long before the process has used five seconds."""
    process = start("form", recorded, "-o", tmp_path / "x.npz", "--size", "100", "--spacing", "0.01")
    while processor_seconds(process) < 5.0:
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    sent = time.perf_counter()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    waited = time.perf_counter() - sent
    assert waited < 1.0
    assert process.returncode == 130
    assert out == ""
    assert err.splitlines()[-1] == "sarfocus: interrupted"  # before it, on a slow machine, what the run was to take
    assert "Traceback" not in err
    assert not (tmp_path / "x.npz").exists()


def test_closed_pipe_is_not_a_failure_with_a_traceback(recorded):
    process = start("info", recorded, "--json")
    process.stdout.close()
    err = process.stderr.read()
    process.stderr.close()
    process.wait(timeout=30)
    assert "Traceback" not in err

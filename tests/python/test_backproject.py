"""backproject and project against the equation, through every door."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sarfocus
from reference import backprojection as oracle
from sarfocus import ImageGrid, backproject, backproject_histories, project

WAVELENGTH = 0.031
SPACING = 0.5
N_PULSE, N_RANGE = 40, 150
PADDING = {150: 39, 128: 32}  # zeros behind the record: at least 32, up to the next length without a prime factor above 7 (189, 160)


def radar(distance: float, n_range: int = N_RANGE) -> dict[str, Any]:
    rng = np.random.default_rng(1)
    tx = np.c_[np.linspace(-20, 20, N_PULSE), np.full(N_PULSE, -distance), 0.2 * distance + rng.standard_normal(N_PULSE)]
    rx = tx + np.array([15.0, 4.0, -2.0])
    start = oracle.ranges(tx, rx, np.zeros((1, 3)))[:, 0] - 35.0
    data = (rng.standard_normal((N_PULSE, n_range)) + 1j * rng.standard_normal((N_PULSE, n_range))).astype(np.complex64)
    return {"data": data, "tx": tx, "rx": rx, "start": start}


def grid(shape: tuple[int, int] = (9, 31)) -> ImageGrid:
    return ImageGrid.plane((-9.0, -14.0, 0.0), (2.1, 0.0, 0.0), (0.0, 0.9, 0.03), shape)


def form(case: dict[str, Any], pixels: ImageGrid, **options: Any) -> np.ndarray:
    return backproject(
        case["data"], (case["tx"], case["rx"]), pixels, range_start=case["start"], range_spacing=SPACING, wavelength=WAVELENGTH, **options
    )


def exact(case: dict[str, Any], points: np.ndarray) -> np.ndarray:
    return oracle.image(
        case["data"],
        case["tx"],
        case["rx"],
        points,
        range_start=case["start"],
        range_spacing=SPACING,
        wavelength=WAVELENGTH,
        padding=PADDING[case["data"].shape[1]],
    )


def error_db(value: np.ndarray, truth: np.ndarray) -> float:
    return float(10 * np.log10(np.sum(np.abs(value - truth) ** 2) / np.sum(np.abs(truth) ** 2)))


@pytest.mark.parametrize("distance", [500.0, 5000.0])
@pytest.mark.parametrize("n_range", PADDING)
def test_critically_sampled_noise_meets_the_stated_error(distance, n_range):
    """White noise fills the whole band, so the cubic is at its worst: -68 dB as stated; the bound asked for is -60 dB."""
    case = radar(distance, n_range)
    pixels = grid()
    truth = exact(case, pixels.positions().reshape(-1, 3)).reshape(pixels.shape)
    assert error_db(form(case, pixels), truth) < -66.0


def test_histories_are_the_terms():
    case = radar(800.0)
    points = grid().positions().reshape(-1, 3)
    where = {"range_start": case["start"], "range_spacing": SPACING, "wavelength": WAVELENGTH}
    histories = backproject_histories(case["data"], (case["tx"], case["rx"]), points, **where)
    assert error_db(histories.sum(axis=1), exact(case, points)) < -66.0


def test_project_is_the_adjoint():
    case = radar(800.0)
    pixels = grid((30, 70))
    rng = np.random.default_rng(2)
    y = (rng.standard_normal(pixels.shape) + 1j * rng.standard_normal(pixels.shape)).astype(np.complex64)
    where = {"range_start": case["start"], "range_spacing": SPACING, "wavelength": WAVELENGTH}
    echo = project(y, pixels, (case["tx"], case["rx"]), n_range=N_RANGE, **where)
    left = np.vdot(y.astype(complex), form(case, pixels).astype(complex))
    right = np.vdot(echo.astype(complex), case["data"].astype(complex))
    # Rounding to 24 bits, against the product of the norms.
    assert abs(left - right) < 2e-6 * np.linalg.norm(echo) * np.linalg.norm(case["data"])


@given(st.integers(-3, 3).filter(bool), st.integers(-3, 3).filter(bool), st.booleans(), st.integers(1, 4))
def test_same_bits_for_any_strides_and_threads(step, other_step, transposed, threads):
    case = radar(800.0)
    expected = form(case, grid(), threads=1)
    shape = (N_RANGE * abs(step), N_PULSE * abs(other_step)) if transposed else (N_PULSE * abs(other_step), N_RANGE * abs(step))
    memory = np.full(shape, np.nan, np.complex64)
    view = (memory.T if transposed else memory)[::other_step, ::step]
    view[...] = case["data"]
    out = np.zeros((31, 9), np.complex64).T
    made = form(case | {"data": view}, grid(), threads=threads, out=out)
    assert made is out
    np.testing.assert_array_equal(made, expected)


def test_unaligned_samples_are_read_too():
    case = radar(800.0)
    record = np.zeros((N_PULSE, N_RANGE), np.dtype([("tag", "u1"), ("sample", np.complex64)]))
    record["sample"] = case["data"]
    np.testing.assert_array_equal(form(case | {"data": record["sample"]}, grid()), form(case, grid()))


REFUSALS: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"data": np.zeros((N_PULSE, N_RANGE))}, TypeError, "data: expected a NumPy array of dtype complex64, got float64"),
    ({"data": [[1j]]}, TypeError, "data: expected a NumPy array of dtype complex64, got list"),
    ({"data": np.zeros((N_PULSE, 0), np.complex64)}, sarfocus.ShapeError, r"data: .* got \(40, 0\)"),
    ({"data": np.zeros(N_RANGE, np.complex64)}, sarfocus.ShapeError, "data: expected 2 dimensions"),
    ({"tx": np.zeros((N_PULSE, 2))}, sarfocus.ShapeError, r"positions: expected \(40, 3\)"),
    ({"rx": np.full((N_PULSE, 3), np.nan)}, sarfocus.NumericalError, r"receive positions: .* nan at \[0, 0\]"),
    ({"start": np.zeros(7)}, sarfocus.ShapeError, "range_start"),
    ({"start": "near"}, TypeError, "range_start: expected an array of real numbers"),
]


@pytest.mark.parametrize(("changes", "error", "message"), REFUSALS)
def test_refusals_name_argument_expected_and_actual(changes, error, message):
    with pytest.raises(error, match=message):
        form(radar(800.0) | changes, grid())


def test_nan_is_refused_with_its_position():
    case = radar(800.0)
    case["data"][17, 23] = complex(1.0, np.nan)
    with pytest.raises(sarfocus.NumericalError, match=r"data: expected finite samples, got 1\+?nanj at \[17, 23\]"):
        form(case, grid())


def test_grid_behind_the_radar_is_refused():
    case = radar(800.0)
    behind = ImageGrid.plane((0, -1700.0, 0), (1, 0, 0), (0, 1, 0), (5, 5))
    with pytest.raises(ValueError, match=r"grid: expected pixels within the recorded ranges of .* m, got a grid .* m away"):
        form(case, behind)


def test_an_image_without_memory_for_it_is_refused_first():
    with pytest.raises(MemoryError, match=r"the result: needs about 7\.3 PiB of memory, .* are available"):
        form(radar(800.0), ImageGrid.plane((-1, -1, 0), (1e-6, 0, 0), (0, 1e-6, 0), (2**25, 2**25 * 30 // 33)))


def test_output_is_checked():
    case = radar(800.0)
    with pytest.raises(ValueError, match="out: expected a writable array"):
        locked = np.zeros((9, 31), np.complex64)
        locked.flags.writeable = False
        form(case, grid(), out=locked)
    with pytest.raises(sarfocus.ShapeError, match=r"out: expected \(9, 31\), got \(9, 30\)"):
        form(case, grid(), out=np.zeros((9, 30), np.complex64))
    with pytest.raises(TypeError, match="out"):
        form(case, grid(), out=np.zeros((9, 31), np.complex128))
    whole = np.zeros((N_PULSE, N_RANGE), np.complex64)
    with pytest.raises(ValueError, match="overlap"):
        form(case | {"data": whole}, grid(), out=whole[:9, :31])


def test_progress_reports_and_stops():
    seen = []
    form(radar(800.0), grid((200, 300)), progress=lambda *update: seen.append(update))
    assert seen[-1] == ("backproject", N_PULSE * 200, N_PULSE * 200)
    with pytest.raises(sarfocus.Cancelled):
        form(radar(800.0), grid((200, 300)), progress=lambda *_: False)
    with pytest.raises(ZeroDivisionError):
        form(radar(800.0), grid((200, 300)), progress=lambda *_: 1 // 0)


def test_other_python_threads_run_meanwhile():
    """The interpreter lock is released: a counting thread goes on while a long call works."""
    counts = []
    stop = threading.Event()

    def count() -> None:
        while not stop.is_set():
            counts.append(time.perf_counter())
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    started = time.perf_counter()
    form(radar(800.0), grid((1000, 1000)), threads=1)
    ended = time.perf_counter()
    stop.set()
    counter.join()
    during = [t for t in counts if started < t < ended]
    # Were the lock held, not one would fall inside; a loaded machine still lets through a tenth of those a millisecond apart.
    assert len(during) > 0.1 * (ended - started) / 0.001 * 0.1


RUN_ONE = """
import sys, numpy as np
sys.path[:0] = sys.argv[1:3]
import test_backproject as tests
case = tests.radar(float(sys.argv[3]))
pixels = tests.ImageGrid.plane((-8.0, -9.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.36, 0.02), (40, 50))
made = tests.form(case, pixels)
chosen = np.random.default_rng(4).choice(made.size, 300, replace=False)
truth = tests.exact(case, pixels.positions().reshape(-1, 3)[chosen])
print(tests.error_db(made.reshape(-1)[chosen], truth))
"""


@pytest.mark.parametrize("kernels", ["baseline", "avx2", "avx512"])
@pytest.mark.parametrize("distance", ["100", "5000"])
def test_every_set_of_kernels_meets_the_stated_error(kernels, distance):
    """The sets that the processor has; asked for another, the library takes the best it has."""
    here = Path(__file__).parent
    run = subprocess.run(
        [sys.executable, "-c", RUN_ONE, str(here), str(here.parent), distance],
        env={**os.environ, "SARFOCUS_KERNELS": kernels},
        capture_output=True,
        text=True,
        check=True,
    )
    assert float(run.stdout) < -64.0

"""Factorised backprojection against the sum in double precision, through the bindings."""

from typing import Any

import numpy as np
import pytest

import sarfocus
from reference import backprojection as oracle
from sarfocus import ImageGrid, backproject, plan_factorized

WAVELENGTH = 0.0312
SPACING = 0.45
N_PULSE, N_RANGE = 1009, 661  # with 801 x 797 pixels enough for factorising to be the quicker way
CENTRE = np.array([0.0, -4300.0, 2500.0])


def path(name: str) -> Any:
    u = np.linspace(-0.5, 0.5, N_PULSE)
    rng = np.random.default_rng(4)
    straight = CENTRE + np.c_[180.0 * u, 0 * u, 0 * u]
    return {
        "straight": straight,
        "curved": np.c_[5000.0 * np.sin(0.04 * u), -4300.0 * np.cos(0.04 * u), 2500.0 + 0 * u],
        "motion": straight + np.c_[0 * u, np.sin(12 * u), 0.8 * np.cos(17 * u)],
        "irregular": straight + np.c_[rng.normal(0, 0.3, N_PULSE), rng.normal(0, 0.02, (N_PULSE, 2))],
        "bistatic": (straight, straight + np.array([40.0, -15.0, 5.0])),
    }[name]


def noise() -> np.ndarray:
    """Noise within 83 % of the band sampled, fading at both ends of the record."""
    rng = np.random.default_rng(1)
    spectrum = np.fft.fft(rng.standard_normal((N_PULSE, N_RANGE)) + 1j * rng.standard_normal((N_PULSE, N_RANGE)), axis=1)
    spectrum[:, np.abs(np.fft.fftfreq(N_RANGE)) > 0.83 / 2] = 0
    fade = np.minimum(1.0, np.sin(np.pi * (np.arange(N_RANGE) + 0.5) / N_RANGE) * 8) ** 2
    return (np.fft.ifft(spectrum, axis=1) * fade).astype(np.complex64)


def plane(shape: tuple[int, int] = (801, 797)) -> ImageGrid:
    return ImageGrid.plane((-160.0, -160.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0), shape)


def settings(positions: Any) -> dict[str, Any]:
    first = positions[0] if isinstance(positions, tuple) else positions
    return {
        "range_start": np.linalg.norm(first, axis=1) - 0.5 * N_RANGE * SPACING,
        "range_spacing": SPACING,
        "wavelength": WAVELENGTH,
    }


def error_db(image: np.ndarray, grid: ImageGrid, data: np.ndarray, positions: Any) -> float:
    """Over a sample of pixels, against the oracle."""
    tx, rx = positions if isinstance(positions, tuple) else (positions, positions)
    rng = np.random.default_rng(9)
    at = np.c_[rng.integers(0, image.shape[0], 120), rng.integers(0, image.shape[1], 120)]
    points = np.array([grid.position(float(i), float(j)) for i, j in at])
    how = settings(positions)
    truth = oracle.image(data, tx, rx, points, padding=81, **how)
    value = image[at[:, 0], at[:, 1]]
    return float(10 * np.log10(np.sum(np.abs(value - truth) ** 2) / np.sum(np.abs(truth) ** 2)))


@pytest.mark.parametrize(
    ("name", "target"),
    [
        ("straight", -40),
        ("straight", -60),
        ("straight", -70),
        ("curved", -60),
        ("motion", -50),
        ("motion", -60),
        ("irregular", -60),
        ("bistatic", -60),
    ],
)
def test_the_error_asked_for_is_kept(name: str, target: float) -> None:
    positions, data, grid = path(name), noise(), plane()
    plan = plan_factorized(positions, grid, n_range=N_RANGE, target_error_db=target, **settings(positions))
    assert plan.factorized, plan.reason
    assert plan.predicted_error_db <= target
    image = backproject(data, positions, grid, method="ffbp", target_error_db=target, **settings(positions))
    assert error_db(image, grid, data, positions) <= target


def test_a_polar_grid() -> None:
    positions, data = path("straight"), noise()
    grid = ImageGrid.polar(
        CENTRE, -CENTRE, (1, 0, 0), range_start=4810.0, range_spacing=0.4, angle_start=-0.031, angle_spacing=0.00008, shape=(789, 809)
    )
    assert plan_factorized(positions, grid, n_range=N_RANGE, **settings(positions)).factorized
    image = backproject(data, positions, grid, method="ffbp", **settings(positions))
    assert error_db(image, grid, data, positions) <= -60


@pytest.mark.parametrize("i", [0, 400])
def test_a_single_bright_point_anywhere_in_a_tile(i: int) -> None:
    """All the energy at one place, at the corner of a tile or within: the prediction takes the mean over a tile."""
    positions, grid = path("straight"), plane()
    target = np.array(grid.position(float(i + 31), 31.0 + i))
    how = settings(positions)
    r = np.linalg.norm(positions - target, axis=1)
    x = (how["range_start"][:, None] + SPACING * np.arange(N_RANGE) - r[:, None]) / (SPACING / 0.83)
    data = (np.sinc(x) * np.exp(-4j * np.pi * r / WAVELENGTH)[:, None]).astype(np.complex64)
    exact = backproject(data, positions, grid, **how)
    image = backproject(data, positions, grid, method="ffbp", target_error_db=-55.0, **how)
    assert 20 * np.log10(np.linalg.norm(image - exact) / np.linalg.norm(exact)) <= -55


def test_small_jobs_are_summed_exactly() -> None:
    positions, data, grid = path("straight"), noise(), plane((16, 17))
    plan = plan_factorized(positions, grid, n_range=N_RANGE, **settings(positions))
    assert not plan.factorized
    assert plan.reason == "the job is small"
    np.testing.assert_array_equal(
        backproject(data, positions, grid, method="ffbp", **settings(positions)), backproject(data, positions, grid, **settings(positions))
    )
    single = backproject(
        data[:1], positions[:1], grid, method="ffbp", range_start=5000.0 - 180, range_spacing=SPACING, wavelength=WAVELENGTH
    )
    assert np.all(np.isfinite(single))


def test_threads_strides_and_out() -> None:
    positions, data, grid = path("motion"), noise(), plane()
    expected = backproject(data, positions, grid, method="ffbp", threads=1, **settings(positions))
    out = np.zeros((797, 801), np.complex64).T
    wide = np.zeros((N_PULSE, 2 * N_RANGE), np.complex64)
    wide[:, ::2] = data
    backproject(wide[:, ::2], positions, grid, method="ffbp", threads=3, out=out, **settings(positions))
    np.testing.assert_array_equal(out, expected)


def test_refusals() -> None:
    positions, data, grid = path("straight"), noise(), plane()
    with pytest.raises(ValueError, match='method: expected "exact" or "ffbp"'):
        backproject(data, positions, grid, method="fast", **settings(positions))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="target_error_db: expected -90"):
        backproject(data, positions, grid, method="ffbp", target_error_db=-10.0, **settings(positions))
    with pytest.raises(ValueError, match="grid: expected a plane or polar grid"):
        backproject(data, positions, ImageGrid.from_points(np.zeros((3, 4, 3))), method="ffbp", **settings(positions))
    data[3, 7] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"\[3, 7\]"):
        backproject(data, positions, grid, method="ffbp", **settings(positions))

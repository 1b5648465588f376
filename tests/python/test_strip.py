"""The steps of stripmap autofocus against the equations, and spga_linear as Python sees it."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference import strip as oracle
from sarfocus import Status, strip

FIELDS = {"wavelength": 0.03125, "prf": 240.0, "velocity": 120.0, "doppler_centroid": 0.0}
BAND = 200.0


def geometry_of(n_range: int, *, first: float = 4000.0, step: float = 0.5, **changes: float) -> sarfocus.StripmapGeometry:
    """Apertures of about 208 samples."""
    return sarfocus.StripmapGeometry(**{**FIELDS, **changes}, slant_range=first + step * np.arange(n_range), doppler_bandwidth=BAND)


def smooth_phase(n: int, amplitude: float = 4.0, cycles: float = 3.0) -> NDArray[np.float64]:
    x = np.arange(n) / n
    return amplitude * (np.sin(2 * np.pi * cycles * x + 0.4) + 0.4 * np.cos(2 * np.pi * 1.7 * cycles * x))


def spread(count: int, n: int, n_range: int) -> NDArray[np.float64]:
    t = np.arange(count)
    return np.stack([np.floor((t + 0.5) * n / count), (5 + 7 * t) % n_range], 1).astype(np.float64)


def blurred_strip(
    geometry: sarfocus.StripmapGeometry,
    pixels: NDArray[np.float64],
    phase: NDArray[np.float64],
    *,
    db: float,
    clutter: float = 1.0,
) -> NDArray[np.complex64]:
    """Points in clutter, as long as the phase error."""
    n, seed = len(phase), 1
    rng = np.random.default_rng(seed)
    amplitude = 10 ** (db / 20) * np.exp(2j * np.pi * rng.random(len(pixels)))
    raw = sarfocus.simulate.stripmap(geometry, pixels, amplitude, n_azimuth=n, clutter_power=clutter, seed=seed)
    return sarfocus.azimuth_compress((raw * np.exp(1j * phase)[:, None]).astype(np.complex64), geometry)


def points_at(pixels: NDArray[np.float64]) -> NDArray[np.void]:
    points = np.zeros(len(pixels), strip.point_dtype)
    points["azimuth"], points["range"] = pixels.T
    points["extent"] = 1
    return points


def line_of(apertures: strip.Apertures, i: int) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.int64]]:
    """Samples, weights and slow times of one line."""
    count = int(apertures.count[i])
    k = int(apertures.start[i]) + np.arange(count)
    return apertures.lines[i, :count].astype(np.complex128), apertures.weight[i, :count].astype(np.float64), k


@pytest.mark.parametrize("doppler_centroid", [0.0, 210.0])
@pytest.mark.parametrize("window", [40, 70])
def test_extraction_is_interception_decompression_and_dechirp(doppler_centroid: float, window: int) -> None:
    n = 1024
    geometry = geometry_of(3, step=700.0, doppler_centroid=doppler_centroid)
    pixels = np.array([[300.0, 0], [512, 1], [700, 2]])
    image = blurred_strip(geometry, pixels + np.array([0.3, 0]), smooth_phase(n), db=25.0)
    apertures = strip.extract(image, geometry, points_at(pixels), window=window, taper=0.3)
    for i, (azimuth_pixel, gate) in enumerate(pixels.astype(int)):
        expected, power = oracle.dechirped(
            image,
            (azimuth_pixel, gate),
            fields={**FIELDS, "doppler_centroid": doppler_centroid},
            slant_range=float(geometry.slant_range[gate]),
            bandwidth=BAND,
            window=window,
            taper=0.3,
        )
        line, _, k = line_of(apertures, i)
        # The same filter sampled at other frequencies: what differs is what a transform of some hundred samples folds back of the
        # signals' tails, and more where an ideal point has next to no power to divide by. Samples in single precision.
        strong = power[k] > 0.5 * np.median(power[k])
        scale = np.abs(expected[k][strong]).mean()
        assert np.abs(line - expected[k])[strong].max() < 5e-3 * scale
        # The whole aperture but its tapered ends is there, no sample twice.
        assert power[k].sum() > 0.99 * power.sum()
        used = apertures.weight[i, : len(k)] >= 0.5
        assert apertures.points["contrast"][i] == pytest.approx(oracle.contrast(line, used), abs=1e-6)
        assert apertures.fm_rate[i] == pytest.approx(geometry.fm_rate(gate) / FIELDS["prf"] ** 2, rel=1e-12)


def test_weight_is_the_inverse_of_the_clutter_in_a_line() -> None:
    """What a piece of clutter becomes when it is decompressed and dechirped: its power goes as 1 / weight over the aperture."""
    n, gates = 1024, 64
    geometry = geometry_of(gates, step=0.01)
    raw = sarfocus.simulate.stripmap(geometry, np.zeros((0, 2)), np.zeros(0, np.complex128), n_azimuth=n, clutter_power=1.0, seed=3)
    image = sarfocus.azimuth_compress(raw, geometry)
    places = np.array([[u, g] for u in (200, 400, 600, 800) for g in range(gates)], np.float64)
    apertures = strip.extract(image, geometry, points_at(places), window=48)
    length = int(apertures.count.min())
    white = (np.abs(apertures.lines[:, :length]) ** 2 * apertures.weight[:, :length]).mean(0)
    used = apertures.weight[0, :length] > 0.1
    # Mean power of 256 exponential draws: 6 %, four times that; the ends, where next to nothing is divided by little, are left out.
    assert np.abs(white[used] / white[used].mean() - 1).max() < 0.3
    assert used.sum() > 0.8 * length


def test_slope_is_the_peak_of_the_periodogram() -> None:
    n, gates = 1024, 16
    geometry = geometry_of(gates)
    image = blurred_strip(geometry, spread(16, n, gates), smooth_phase(n), db=22.0)
    points = strip.select_points(image, geometry)
    apertures = strip.extract(image, geometry, points)
    seams = strip.match_slope(apertures, pairs_per_point=3)
    assert len(seams) > 20
    for seam in seams[::3]:
        (d1, w1, k1), (d2, w2, k2) = (line_of(apertures, int(seam[name])) for name in ("first", "second"))
        _, i1, i2 = np.intersect1d(k1, k2, return_indices=True)
        assert seam["overlap"] == i1.size
        product = np.sqrt(w1[i1] * w2[i2]) * d1[i1] * d2[i2].conj()
        # Displacements of either point within the window.
        limit = 2 * np.pi * apertures.window * (apertures.fm_rate[seam["first"]] + apertures.fm_rate[seam["second"]])
        expected = oracle.tone_slope(product, min(limit, np.pi))
        # Newton steps end within a thousandth of a cell of the overlap's periodogram.
        assert abs(seam["slope"] - expected) < 1e-3 * 2 * np.pi / i1.size
        k = np.arange(i1.size)
        coherent = np.abs(np.sum(product * np.exp(-1j * expected * k))) ** 2 / (k.size * np.sum(np.abs(product) ** 2))
        assert seam["coherence"] == pytest.approx(coherent, rel=1e-4)


def test_search_matrix_is_that_of_the_paper() -> None:
    n = 1024
    geometry = geometry_of(2, step=900.0)  # K of the second gate 22 % smaller
    pixels = np.array([[450.0, 0], [540, 1]])
    image = blurred_strip(geometry, pixels + np.array([[2.0, 0], [-3.0, 0]]), smooth_phase(n), db=40.0, clutter=0.0)
    apertures = strip.extract(image, geometry, points_at(pixels))
    (d1, w1, k1), (d2, w2, k2) = (line_of(apertures, i) for i in (0, 1))
    k, i1, i2 = np.intersect1d(k1, k2, return_indices=True)
    rates = (float(apertures.fm_rate[0]), float(apertures.fm_rate[1]))
    # Back to the chirps [Xie2023, eq. 8], of which the oracle knows only where the points were found.
    chirps = [
        np.sqrt(w[i]) * d[i] * np.exp(-1j * np.pi * rate * (k - middle) ** 2)
        for d, w, i, rate, middle in ((d1, w1, i1, rates[0], 450), (d2, w2, i2, rates[1], 540))
    ]
    matrix = strip.search_matrix(apertures, 0, 1, 16)
    expected = oracle.slope_matrix((chirps[0], chirps[1]), k.astype(np.float64), (450.0, 540.0), rates, 16)
    np.testing.assert_allclose(matrix, expected, atol=1e-6)
    pixel = 2 * np.pi * rates[0]
    # Where both are taken for where they are the slope is none [eq. 12], to the tenth of a pixel or so that displaced ends ripple by.
    assert matrix[8 + 2, 8 - 3] < 0.2 * pixel
    assert matrix[8 + 2, 8 + 3] > 4 * pixel


def test_stitching_is_weighted_least_squares() -> None:
    n, gates = 1024, 16
    geometry = geometry_of(gates)
    image = blurred_strip(geometry, spread(24, n, gates), smooth_phase(n), db=30.0)
    points = points_at(spread(24, n, gates))
    apertures = strip.extract(image, geometry, points)
    seams = strip.match_slope(apertures)
    rng = np.random.default_rng(3)
    truth = rng.normal(0, 0.05, len(points))
    seams["slope_std"] = rng.uniform(1e-4, 4e-4, len(seams))
    seams["slope"] = truth[seams["first"]] - truth[seams["second"]] + seams["slope_std"] * rng.normal(size=len(seams))
    seams["coherence"] = 0.99
    found = strip.stitch(apertures, seams)
    assert found.segments == 1
    seams = seams[found.seams["weight"] > 0]  # of overlaps with next to no independent samples nothing is believed
    assert len(seams) > 50
    expected = oracle.stitched(seams["first"], seams["second"], seams["slope"], seams["slope_std"], len(points))
    # Robust weights (1 + x^2)^-2, x the residual in units of pi / overlap > 0.015: residuals of 3e-4 change them by 1e-3, the solution by
    # that share of its own uncertainty of some 2e-4.
    np.testing.assert_allclose(found.slope, expected, atol=2e-6)
    np.testing.assert_allclose(
        found.seams["residual"][found.seams["weight"] > 0],
        seams["slope"] - (found.slope[seams["first"]] - found.slope[seams["second"]]),
        atol=1e-12,
    )
    assert found.seams["weight"].sum() == pytest.approx(1.0)


def test_gradient_is_summed_up_as_the_equation_says() -> None:
    n, gates = 1024, 16
    geometry = geometry_of(gates)
    image = blurred_strip(geometry, spread(24, n, gates), smooth_phase(n), db=28.0)
    apertures = strip.extract(image, geometry, strip.select_points(image, geometry))
    stitching = strip.stitch(apertures, strip.match_slope(apertures))
    found = strip.integrate_gradient(apertures, stitching)
    used = [i for i in range(len(apertures)) if stitching.segment[i] >= 0]
    whitened = []
    for i in used:
        line, weight, _ = line_of(apertures, i)
        whitened.append(line * np.sqrt(weight))
    expected = oracle.summed_gradient(whitened, [int(apertures.start[i]) for i in used], stitching.slope[used], n)
    reached = np.isfinite(found.phase_std)
    assert reached.mean() > 0.9
    # A thousand steps; roots of the weights in single precision.
    difference = (found.phase - expected)[reached]
    assert np.abs(difference - difference.mean()).max() < 1e-6


def test_refinement_finds_the_most_likely_phase() -> None:
    """A plain solver over all unknowns, given what the refinement says of noise, amplitudes and roughness, ends at the same phase."""
    n, gates = 150, 12
    geometry = geometry_of(gates, first=800.0)  # apertures of 42 samples
    rng = np.random.default_rng(5)
    phase = np.cumsum(np.cumsum(rng.normal(0, 0.05, n)))
    phase = oracle.without_line(phase) / 4
    pixels = np.stack([np.linspace(8, 141, 24).astype(int), np.arange(24) % gates], 1).astype(np.float64)
    image = blurred_strip(geometry, pixels, phase, db=22.0)
    apertures = strip.extract(image, geometry, points_at(pixels), window=60)
    stitching = strip.stitch(apertures, strip.match_slope(apertures))
    found = strip.refine(apertures, stitching, windows=[1.0], rounds=30, tolerance=1e-7)
    assert found.knot == 1.0
    assert stitching.segments == 1
    used = [i for i in range(len(apertures)) if stitching.segment[i] >= 0]
    assert len(used) > 18
    parts = [line_of(apertures, i) for i in used]
    covered = slice(min(int(k[0]) for _, _, k in parts), max(int(k[-1]) for _, _, k in parts) + 1)
    lines = [
        oracle.Aperture(
            line, weight, k - covered.start, int(apertures.points["azimuth"][i]) - covered.start, found.signal[i], found.noise[i]
        )
        for i, (line, weight, k) in zip(used, parts, strict=True)
    ]
    expected = oracle.posterior_phase(lines, float(found.smoothness[0]), oracle.without_line(phase[covered]))
    difference = oracle.without_line(found.phase[covered] - expected)
    deviation = np.sqrt(np.nanmean(found.phase_std**2))
    # Another optimum of the same function would be deviations away; signal and noise are refitted to the end, hence not to rounding.
    assert np.sqrt(np.mean(difference**2)) < 0.1 * deviation
    # And it is an estimate of the phase, as good as it says.
    error = oracle.without_line(found.phase[covered] - phase[covered])
    assert np.sqrt(np.mean(error**2)) < 3 * deviation


def test_the_chain_is_what_spga_linear_does() -> None:
    n, gates = 1024, 32
    geometry = geometry_of(gates)
    phase = smooth_phase(n)
    image = blurred_strip(geometry, spread(32, n, gates), phase, db=30.0)
    result = sarfocus.spga_linear(image, geometry)
    assert result.status is Status.converged
    assert result.image.dtype == np.complex64
    assert result.phase_error.shape == result.phase_std.shape == (n,)
    assert result.points.dtype.names == ("azimuth", "range", "shift", "weight", "contrast")
    details: dict[str, Any] = result.diagnostics["strip"]
    assert {"seams", "segment", "segments", "coverage", "point_quality", "held_out_gain", "knot"} <= set(details)
    assert len(details["segment"]) == len(details["point_quality"]) == len(details["held_out_gain"]) == len(result.points)
    assert {"select", "extract", "match", "stitch", "estimate", "score", "correct"} <= set(result.diagnostics["timings"])
    assert "converged" in result.summary()
    # Two paths to the same image: four transforms in single precision.
    corrected = strip.azimuth_correct(image, geometry, result.phase_error)
    np.testing.assert_allclose(corrected, result.image, atol=5e-6 * np.abs(image).max())
    # Step by step the same points, and a phase as good.
    points = strip.select_points(image, geometry)
    assert {tuple(p) for p in points[["range"]].tolist()} == {(int(g),) for g in result.points["range"]}
    apertures = strip.extract(image, geometry, points)
    stitching = strip.stitch(apertures, strip.match_slope(apertures))
    refined = strip.refine(apertures, stitching)
    assert np.std(oracle.without_line(refined.phase - phase)) < 2 * np.std(oracle.without_line(result.estimate - phase)) + 0.05


def test_arguments_are_checked_at_the_door() -> None:
    n, gates = 512, 8
    geometry = geometry_of(gates)
    image = blurred_strip(geometry, spread(8, n, gates), smooth_phase(n), db=30.0)
    with pytest.raises(ValueError, match="matching: expected"):
        sarfocus.spga_linear(image, geometry, matching="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="gauge: expected"):
        sarfocus.spga_linear(image, geometry, gauge="mean")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="tie_points"):
        sarfocus.spga_linear(image, geometry, gauge="tie_points")
    with pytest.raises(TypeError, match="image"):
        sarfocus.spga_linear(image.astype(np.complex128), geometry)  # type: ignore[arg-type]
    with pytest.raises(sarfocus.ShapeError, match="out"):
        sarfocus.spga_linear(image, geometry, out=np.zeros((n, gates + 1), np.complex64))
    with pytest.raises(sarfocus.ShapeError, match="image"):
        sarfocus.spga_linear(image[:, 1:], geometry)
    with pytest.raises(ValueError, match="doppler_centroid"):
        sarfocus.spga_linear(image, geometry_of(gates, doppler_centroid=800.0))
    with pytest.raises(sarfocus.NumericalError, match="zero"):
        sarfocus.spga_linear(np.zeros_like(image), geometry)
    spoilt = image.copy()
    spoilt[100, 3] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"\[100, 3\]"):
        sarfocus.spga_linear(spoilt, geometry)
    with pytest.raises(KeyboardInterrupt):
        sarfocus.spga_linear(image, geometry, progress=interrupt)
    with pytest.raises(ValueError, match="points"):
        strip.extract(image, geometry, points_at(np.array([[0.0, 8.0]])))
    read_only = image.copy()
    read_only.flags.writeable = False
    assert sarfocus.spga_linear(read_only, geometry).image.shape == image.shape
    with pytest.raises((TypeError, ValueError), match="out"):
        sarfocus.spga_linear(image, geometry, out=read_only)


def interrupt(*_: object) -> bool:
    raise KeyboardInterrupt


def test_output_goes_where_it_is_wanted() -> None:
    n, gates = 1024, 16
    geometry = geometry_of(gates)
    image = blurred_strip(geometry, spread(24, n, gates), smooth_phase(n), db=30.0)
    expected = sarfocus.spga_linear(image, geometry, threads=1)
    assert expected.status is Status.converged
    out = np.zeros((gates, 2 * n), np.complex64)[:, ::2].T
    assert sarfocus.spga_linear(np.asfortranarray(image), geometry, out=out, threads=3).image is out
    np.testing.assert_array_equal(out, expected.image)
    place = image.copy()
    assert sarfocus.spga_linear(place, geometry, out=place, threads=2).image is place
    np.testing.assert_array_equal(place, expected.image)
    baseline = sarfocus.spga(image, geometry, iterations=3)
    assert baseline.phase_error.shape == (n,)
    assert sarfocus.quality.entropy(baseline.image) <= sarfocus.quality.entropy(image)

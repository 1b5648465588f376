"""Adaptive PGA: its steps against the paper's equations, and the two methods as Python sees them."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference import adaptive as oracle
from sarfocus import Status, adaptive

Image = NDArray[np.complex64]


def speckle(n: int, m: int, seed: int = 0) -> NDArray[np.complex128]:
    rng = np.random.default_rng(seed)
    return (rng.standard_normal((n, m)) + 1j * rng.standard_normal((n, m))) / np.sqrt(2)


def scene(points: int, n: int = 256, m: int = 160, peak_db: float = 35.0, seed: int = 0) -> Image:
    """Points at broken pixels in speckle of power one."""
    rng = np.random.default_rng(seed + 1000)
    out = speckle(n, m, seed)
    k = np.fft.fftfreq(n)
    for _ in range(points):
        spectrum = 10 ** (peak_db / 20) * np.exp(2j * np.pi * (rng.random() - k * rng.uniform(0.1 * n, 0.9 * n)))
        spectrum[n // 2] = 0  # a broken shift of the Nyquist component has no single value
        out[:, rng.integers(m)] += np.fft.ifft(spectrum)
    return out.astype(np.complex64)


def turned(image: Image, phase: NDArray[np.float64]) -> Image:
    spectrum = np.fft.fftshift(np.fft.fft(image, axis=0), axes=0) * np.exp(1j * phase)[:, None]
    return np.fft.ifft(np.fft.ifftshift(spectrum, axes=0), axis=0).astype(np.complex64)


def rms_without_line(phase: NDArray[np.float64]) -> float:
    x = np.arange(len(phase))
    return float(np.std(phase - np.polyval(np.polyfit(x, phase, 1), x)))


ERROR = 8.0 * np.linspace(-1, 1, 256) ** 2 + np.sin(np.linspace(0, 20, 256))


@pytest.mark.parametrize("shape", [(601, 141), (64, 64), (300, 3), (16, 40)])
def test_the_gate_of_single_pixels_is_the_papers(shape: tuple[int, int]) -> None:
    image = (speckle(*shape) + 30 * (np.arange(shape[0] * shape[1]).reshape(shape) == 5 * shape[1] + 1)).astype(np.complex64)
    pfa = 1e-3
    strong, cells = adaptive.cfar_gate(image, extents=[1], false_alarm_probability=pfa)
    assert [(c["azimuth"], c["range"]) for c in cells] == oracle.tested_cells(image)
    power = np.abs(image.astype(np.complex128)) ** 2
    for c in cells:
        mean, count = oracle.reference_mean(power[:, c["range"]], c["azimuth"])
        assert c["extent"] == 1
        assert c["value"] == pytest.approx(power[c["azimuth"], c["range"]], rel=1e-6)
        assert c["clutter"] == pytest.approx(mean, rel=1e-6)
        # The pixels are independent but for chance: neighbours that correlate by up to 0.1 count for a reference cell less.
        least, most = (oracle.factor(count, pfa / image.size), oracle.factor(max(count - 2, 1), pfa / image.size))
        assert least * (1 - 1e-9) <= c["threshold"] / c["clutter"] <= most * (1 + 1e-9)
        assert c["detected"] == (c["value"] > c["threshold"])
    assert strong == cells["detected"].any()


def test_mu_as_given_compares_amplitudes() -> None:
    image = scene(3)
    _, cells = adaptive.cfar_gate(image, mu=5.0)
    assert [(c["azimuth"], c["range"]) for c in cells] == oracle.tested_cells(image)
    for c in cells:
        mean, _ = oracle.reference_mean(np.abs(image[:, c["range"]]), c["azimuth"])
        assert c["value"] == pytest.approx(abs(image[c["azimuth"], c["range"]]), rel=1e-6)
        assert c["threshold"] == pytest.approx(5.0 * mean, rel=1e-6)


def test_plain_speckle_has_no_strong_points() -> None:
    # Stated chance 1e-3 of a scene: of 60, with a probability of 0.998 not more than one.
    assert sum(adaptive.cfar_gate(speckle(128, 96, seed).astype(np.complex64))[0] for seed in range(60)) <= 1


@pytest.mark.parametrize("peak", [0.0, 5.0, 10.0])
def test_defocused_points_are_found(peak: float) -> None:
    n = 512
    error = peak * np.linspace(-1, 1, n) ** 2
    for seed in range(3):
        assert adaptive.cfar_gate(turned(scene(3, n, 256, 27.0, seed), error))[0]


def test_bright_fields_are_no_strong_points() -> None:
    bright = np.exp(np.add.outer(np.cos(np.linspace(0, 20, 512)), np.cos(np.linspace(0, 15, 300))))
    for seed in range(3):
        assert not adaptive.cfar_gate((bright * speckle(512, 300, seed)).astype(np.complex64))[0]


def test_mean_filter_is_the_papers() -> None:
    image = scene(2, 33, 17)
    out = adaptive.mean_filter(image)
    expected = oracle.mean_filter(image)
    np.testing.assert_allclose(out, expected, atol=2e-7 * np.abs(expected).max())  # rounded once
    np.testing.assert_array_equal(out[0], image[0])
    np.testing.assert_array_equal(adaptive.mean_filter(image[:2, :5].copy()), image[:2, :5])
    with pytest.raises(sarfocus.ShapeError):
        adaptive.mean_filter(image[:0])


def test_gates_to_denoise_are_a_sixteenth_inside_the_image() -> None:
    assert adaptive.gates_to_denoise(1024, 500) == (468, 64)
    assert adaptive.gates_to_denoise(1024, 3) == (0, 64)
    assert adaptive.gates_to_denoise(1024, 1023) == (960, 64)
    assert adaptive.gates_to_denoise(3, 1) == (0, 3)
    assert adaptive.gates_to_denoise(1, 0) == (0, 1)
    with pytest.raises(ValueError, match="centre"):
        adaptive.gates_to_denoise(10, 10)


@pytest.mark.parametrize(("n", "length"), [(1024, 512), (601, 128), (16, 512), (513, 512), (100, 2), (767, 512), (768, 512), (769, 512)])
def test_sub_apertures_overlap_by_half_and_cover_everything(n: int, length: int) -> None:
    parts = adaptive.sub_apertures(n, length)
    assert parts == oracle.sub_apertures(n, length)
    assert parts[0][0] == 0
    assert sum(parts[-1]) == n
    assert all(b[0] - a[0] == length // 2 and a[1] == length for a, b in pairwise(parts))
    assert len(parts) == 1 or parts[-1][1] > length // 2


@pytest.mark.parametrize(("shape", "length"), [((601, 141), 128), ((64, 64), 512), ((300, 3), 50), ((130, 257), 128)])
def test_gate_energies_are_sums_of_intensity(shape: tuple[int, int], length: int) -> None:
    image = speckle(*shape).astype(np.complex64)
    energies = adaptive.gate_energies(image, length)
    np.testing.assert_allclose(energies, oracle.gate_energies(image, length), rtol=1e-6)  # intensities are rounded to single precision
    for same in (np.asfortranarray(image), image[::-1, ::-1].copy()[::-1, ::-1]):
        for threads in (1, 2, 3):
            np.testing.assert_array_equal(adaptive.gate_energies(same, length, threads=threads), energies)


@pytest.mark.parametrize("k", [1, 3, 100, 128, 1000])
@pytest.mark.parametrize("eta", [0.5, 1.2, 2.7, 50.0])
def test_gates_are_chosen_as_the_equations_say(k: int, eta: float) -> None:
    rng = np.random.default_rng(k)
    for strong in (0, 1, 7, 60):
        energies = rng.gamma(20.0, 1.0, 100)
        energies[rng.choice(100, strong, replace=False)] *= rng.uniform(2, 10, strong)
        gates, m1, m2 = adaptive.choose_gates(energies, k, eta)
        assert gates.tolist() == oracle.choose_gates(energies, k, eta)
        if len(gates):
            assert m1 == pytest.approx(energies[gates].mean())
            assert m2 == pytest.approx(np.delete(energies, gates).mean())
        else:
            assert m1 <= eta * m2


def test_gates_of_degenerate_sub_apertures() -> None:
    assert adaptive.choose_gates(np.zeros(10))[0].size == 0
    assert adaptive.choose_gates([5.0])[0].size == 0  # nothing to compare with
    assert adaptive.choose_gates([5.0, 5.0], 2, 0.5)[0].tolist() == [0]
    assert adaptive.choose_gates([1.0, 0.0, 0.0], 2, 2.7)[0].tolist() == [0, 1]
    for energies, k, eta, message in (
        ([1.0, np.nan], 1, 2.7, "energies"),
        ([1.0, -1.0], 1, 2.7, "energies"),
        ([1.0], 0, 2.7, "k: "),
        ([1.0], 1, 0.0, "eta: "),
        ([1.0], 1, np.nan, "eta: "),
        ([], 1, 2.7, "energies"),
    ):
        with pytest.raises(ValueError, match=message):
            adaptive.choose_gates(energies, k, eta)


def test_few_strong_points_are_focused_and_the_decisions_told() -> None:
    result = sarfocus.adaptive_pga(turned(scene(6), ERROR), sub_aperture=64)
    assert result.status in (Status.converged, Status.max_iterations)
    # Six points 35 dB over speckle, 11 dB a sample: bound 0.081 rad, of which twice is allowed.
    assert rms_without_line(result.phase_error - ERROR) < 0.16
    told = result.diagnostics["adaptive"]
    assert told["strong_points"]
    assert told["denoised"] == 0
    assert [(s["first"], s["count"]) for s in told["sub_apertures"]] == adaptive.sub_apertures(256, 64)
    for s in told["sub_apertures"]:
        assert s["gates"] == 0 or s["mean_strong"] > 2.7 * s["mean_rest"]
    assert max(s["gates"] for s in told["sub_apertures"]) > 0
    assert result.diagnostics["method"] == "adaptive_pga"
    assert "gates a sub-aperture" in result.summary()
    expected = turned(turned(scene(6), ERROR), -result.phase_error)
    np.testing.assert_allclose(result.image, expected, atol=2e-6 * np.abs(expected).max())  # two transforms in single precision


def test_a_detected_point_is_used_where_the_energy_rule_skips_everything() -> None:
    image = turned(scene(6), ERROR)
    result = sarfocus.adaptive_pga(image, eta=1e6)
    assert all(s["gates"] == 0 for s in result.diagnostics["adaptive"]["sub_apertures"])
    assert sarfocus.quality.entropy(result.image) < sarfocus.quality.entropy(image)


@pytest.mark.parametrize("weak_scene", ["denoise", "skip"])
def test_plain_speckle_comes_back_itself(weak_scene: Any) -> None:
    for seed in range(5):
        image = turned(speckle(256, 160, seed).astype(np.complex64), ERROR * (seed % 2))
        result = sarfocus.adaptive_pga(image, weak_scene=weak_scene)
        assert result.image is image
        assert result.status is (Status.no_strong_points if weak_scene == "skip" else Status.not_improved)
        assert result.diagnostics["adaptive"]["denoised"] == (0 if weak_scene == "skip" else 10)
        assert "no strong points" in result.summary()


def test_the_sign_of_the_mean_filter_does_not_reach_the_phase() -> None:
    # No cell passes, so the phase comes from the denoised gates; those hold points, and the filter is negative over a third of the band.
    rng = np.random.default_rng(3)
    image = scene(0, 256, 160)
    k = np.fft.fftfreq(256)
    for gate in range(60, 100, 2):
        image[:, gate] += np.fft.ifft(10**1.75 * np.exp(2j * np.pi * (rng.random() - k * rng.uniform(30, 220)))).astype(np.complex64)
    smooth = 6.0 * np.linspace(-1, 1, 256) ** 2
    result = sarfocus.adaptive_pga(turned(image, smooth), mu=1e6, do_no_harm=False)
    assert result.diagnostics["adaptive"]["amplitudes"]
    told = result.diagnostics["adaptive"]
    assert not told["strong_points"]
    assert told["denoised"] == 10
    inner = slice(13, -13)  # the outermost pulses have next to no power left
    assert rms_without_line((result.phase_error - smooth)[inner]) < 1.0  # a step of pi over a third of the band is 1.5 rad


@pytest.mark.parametrize("method", [sarfocus.adaptive_pga, sarfocus.conventional_pga])
def test_same_bits_for_any_strides_threads_and_place(method: Any) -> None:
    image = turned(scene(20), ERROR)
    judged = method is sarfocus.adaptive_pga
    expected = method(image, threads=1, do_no_harm=judged)
    assert expected.status not in (Status.not_improved, Status.no_strong_points)
    for other in (np.asfortranarray(image), image[::-1].copy()[::-1], np.repeat(image, 2, axis=1)[:, ::2]):
        for threads in (2, 3):
            again = method(other, threads=threads, do_no_harm=judged)
            np.testing.assert_array_equal(again.image, expected.image)
            np.testing.assert_array_equal(again.phase_error, expected.phase_error)
    place = image.copy()
    assert method(place, do_no_harm=judged, out=place).image is place
    np.testing.assert_array_equal(place, expected.image)


@pytest.mark.parametrize("shape", [(601, 140), (64, 64), (256, 3), (16, 30), (17, 1)])
@pytest.mark.parametrize("method", [sarfocus.adaptive_pga, sarfocus.conventional_pga])
def test_any_size_is_taken(method: Any, shape: tuple[int, int]) -> None:
    image = scene(4, *shape, peak_db=30.0)
    result = method(image)
    assert result.phase_error.shape == result.phase_std.shape == (shape[0],)
    assert sarfocus.quality.entropy(result.image) <= sarfocus.quality.entropy(image)


def test_conventional_uses_k_gates_and_the_gradient() -> None:
    image = turned(scene(40), ERROR)
    result = sarfocus.conventional_pga(image, k=16, do_no_harm=False)
    assert result.diagnostics["method"] == "conventional_pga"
    assert len(result.diagnostics["rounds"]) == 6
    assert rms_without_line(result.phase_error - ERROR) < 0.5
    better = sarfocus.adaptive_pga(image, do_no_harm=False)
    assert sarfocus.quality.entropy(better.image) < sarfocus.quality.entropy(result.image) + 1e-3


def strip_of(points: int, seed: int = 0) -> tuple[Image, sarfocus.StripmapGeometry, NDArray[np.float64]]:
    n, n_range = 1200, 48
    rng = np.random.default_rng(seed)
    geometry = sarfocus.StripmapGeometry(
        wavelength=0.03125,
        prf=240.0,
        velocity=120.0,
        doppler_centroid=0.0,
        slant_range=4000.0 + 0.5 * np.arange(n_range),
        doppler_bandwidth=200.0,
    )
    pixels = np.stack([np.floor((np.arange(points) + 0.5) * n / max(points, 1)), rng.integers(0, n_range, points)], 1).astype(np.float64)
    amplitude = 10**1.5 * np.exp(2j * np.pi * rng.random(points))
    if points:
        raw = sarfocus.simulate.stripmap(geometry, pixels, amplitude, n_azimuth=n, clutter_power=1.0, seed=seed)
    else:
        raw = sarfocus.azimuth_decompress(speckle(n, n_range, seed).astype(np.complex64), geometry)
    x = np.arange(n) / n
    phase = 4.0 * (np.sin(2 * np.pi * 3 * x + 0.4) + 0.4 * np.cos(2 * np.pi * 5 * x))
    return sarfocus.azimuth_compress((raw * np.exp(1j * phase)[:, None]).astype(np.complex64), geometry), geometry, phase


def test_a_strip_is_focused_from_the_points_of_its_sub_apertures() -> None:
    image, geometry, phase = strip_of(40, 2)
    result = sarfocus.adaptive_pga(image, geometry)
    assert result.status is Status.converged
    # 40 points at 30 dB over apertures of 208 samples: what spga_linear is asked for.
    assert rms_without_line(result.phase_error - phase) < 0.15
    told = result.diagnostics["adaptive"]
    assert told["strong_points"]
    assert told["sub_apertures"][0]["count"] == 208
    assert sarfocus.quality.entropy(result.image) < sarfocus.quality.entropy(image)
    again = sarfocus.adaptive_pga(np.asfortranarray(image), geometry, threads=3)
    np.testing.assert_array_equal(again.image, result.image)
    conventional = sarfocus.conventional_pga(image, geometry)
    assert sarfocus.quality.entropy(conventional.image) <= sarfocus.quality.entropy(image)
    assert sarfocus.quality.entropy(result.image) <= sarfocus.quality.entropy(conventional.image)


@pytest.mark.parametrize("weak_scene", ["denoise", "skip"])
def test_a_strip_of_clutter_comes_back_itself(weak_scene: Any) -> None:
    image, geometry, _ = strip_of(0)
    result = sarfocus.adaptive_pga(image, geometry, weak_scene=weak_scene)
    assert result.image is image
    assert not result.phase_error.any()
    assert not result.diagnostics["adaptive"]["strong_points"]


@pytest.mark.parametrize("with_geometry", [False, True])
@pytest.mark.parametrize("method", [sarfocus.adaptive_pga, sarfocus.conventional_pga])
def test_refusals(method: Any, with_geometry: bool) -> None:
    image, strip_geometry, _ = strip_of(3)
    geometry = strip_geometry if with_geometry else None
    broken = image.copy()
    broken[7, 9] = np.nan
    for bad, error, message in (
        (np.zeros_like(image), sarfocus.NumericalError, "all zero"),
        (broken, sarfocus.NumericalError, r"\[7, 9\]"),
        (image[:0], sarfocus.ShapeError, "image"),
        (image.astype(np.complex128), TypeError, "complex64, got complex128"),
    ):
        with pytest.raises(error, match=message):
            method(bad, geometry)
    for options, message in (({"k": 0}, "k: "), ({"sub_aperture": 7}, "sub_aperture: "), ({"sub_aperture": -2}, "sub_aperture: ")):
        with pytest.raises(ValueError, match=message):
            method(image, geometry, **options)
    with pytest.raises(sarfocus.Cancelled):
        method(image, geometry, progress=lambda *_: False)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"eta": 0.0}, "eta"),
        ({"eta": float("nan")}, "eta"),
        ({"weak_scene": "guess"}, "weak_scene"),
        ({"estimator": "best"}, "estimator"),
        ({"extents": []}, "extents"),
        ({"extents": [3]}, "extents"),
        ({"mu": -1.0}, "mu"),
        ({"false_alarm_probability": 0.0}, "false_alarm_probability"),
    ],
)
def test_options_are_checked(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sarfocus.adaptive_pga(scene(3), **options)

"""minimum_entropy and maximum_contrast: what they find, what they must not believe, and one iteration against NumPy."""

from itertools import pairwise

import numpy as np
import pytest

import sarfocus
from reference.sharpness import fixed_point_step
from sarfocus import Status, maximum_contrast, minimum_entropy

N = 128
X = np.linspace(-1, 1, N, endpoint=False)
METHODS = [minimum_entropy, maximum_contrast]


def scene(points, n=N, m=N, peak_db=35.0, seed=0):
    """Points at whole and broken pixels in speckle of power one."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.fft(rng.standard_normal((n, m)) + 1j * rng.standard_normal((n, m)), axis=0) / np.sqrt(2)
    k = np.fft.fftfreq(n)
    for _ in range(points):
        place, gate = rng.uniform(0.1 * n, 0.9 * n), rng.integers(m)
        spectrum[:, gate] += 10 ** (peak_db / 20) * np.exp(2j * np.pi * (rng.random() - k * place))
    return np.fft.ifft(spectrum, axis=0).astype(np.complex64)


def texture(seed=0):
    """Speckle under a smooth field of which the brightest parts are 20 dB above the darkest."""
    rng = np.random.default_rng(seed)
    window = np.exp(-2 * ((np.fft.fftfreq(N)[:, None] * 20) ** 2 + (np.fft.fftfreq(N)[None] * 20) ** 2))
    field = np.fft.ifft2(np.fft.fft2(rng.standard_normal((N, N))) * window).real
    return (scene(0, seed=seed) * np.exp(field / field.std())).astype(np.complex64)


def turned(image, phase):
    spectrum = np.fft.fftshift(np.fft.fft(image, axis=0), axes=0) * np.exp(1j * phase)[:, None]
    return np.fft.ifft(np.fft.ifftshift(spectrum, axes=0), axis=0).astype(np.complex64)


def without_line(phase):
    x = np.arange(len(phase))
    return phase - np.polyval(np.polyfit(x, phase, 1), x)


def rms(phase):
    return float(np.std(without_line(phase)))


def smooth(seed, radians=5.0):
    rng = np.random.default_rng(seed)
    shape = sum(rng.standard_normal() * np.cos(np.pi * h * (X + 1) / 2 + rng.uniform(0, 6)) for h in range(1, 9))
    shape = without_line(shape)
    return radians * shape / np.abs(shape).max()


ERRORS = {"quadratic 5": 5 * X**2, "quadratic 20": 20 * X**2, "order 6": 15 * X**6 - 8 * X**3, "smooth": smooth(7)}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", list(ERRORS))
def test_errors_are_found_among_many_points(method, name):
    blurred = turned(scene(60), ERRORS[name])
    result = method(blurred)
    assert result.status in (Status.converged, Status.max_iterations), result.summary()
    # 60 points at 14 dB a sample: bound 0.018 rad. Speckle that shares a gate with a point pulls too: twice is usual, four times allowed.
    assert rms(result.phase_error - ERRORS[name]) < 0.075
    assert sarfocus.quality.entropy(result.image) < sarfocus.quality.entropy(blurred)
    np.testing.assert_allclose(result.image, turned(blurred, -result.phase_error), atol=3e-6 * np.abs(result.image).max())
    # From two halves and smoothed: no more than the order of magnitude is claimed.
    stated = float(np.sqrt(np.mean(result.phase_std**2)))
    assert rms(result.phase_error - ERRORS[name]) / 4 < stated < 4 * rms(result.phase_error - ERRORS[name])
    assert result.diagnostics["method"] == method.__name__
    assert result.points["weight"].sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("method", "measure"), [(minimum_entropy, "entropy"), (maximum_contrast, "contrast")])
def test_one_iteration_is_that_of_the_equation(method, measure):
    blurred = turned(scene(60), 0.6 * np.sin(9 * X))
    expected = fixed_point_step(blurred, measure)
    assert np.abs(expected).max() < 2.0  # beyond, the step is shortened
    one = method(blurred, polynomial=1, smooth_rounds=0, free_rounds=1, do_no_harm=False)
    # The pull is a sum over 128 gates in single precision.
    np.testing.assert_allclose(without_line(one.estimate), without_line(expected), atol=2e-4)


def test_no_round_makes_the_measure_worse():
    blurred = turned(scene(20), ERRORS["smooth"])
    values = []
    for rounds in (0, 1, 2, 4, 8, 16):
        result = minimum_entropy(blurred, polynomial=1, smooth_rounds=0, free_rounds=rounds, do_no_harm=False)
        values.append(sarfocus.quality.entropy(result.image))
    # Taking the line off shifts points among the pixels, which changes the entropy by about a hundredth.
    assert all(b < a + 0.02 for a, b in pairwise(values))
    assert values[-1] < values[0] - 0.1


def sparse_scenes():
    return {
        "speckle": scene(0, seed=1),
        "one point between pixels": scene(1, seed=2, peak_db=30.0),
        "two points": scene(2, seed=3, peak_db=26.0),
        "texture": texture(4),
    }


@pytest.mark.parametrize("name", list(sparse_scenes()))
def test_least_entropy_alone_harms_sparse_scenes_and_is_handed_back(name):
    """Plain minimum entropy lowers the entropy of an image in focus with a phase that is wrong by tenths of a radian and more."""
    image = sparse_scenes()[name]
    plain = minimum_entropy(image, do_no_harm=False)
    assert sarfocus.quality.entropy(plain.image) < sarfocus.quality.entropy(image) - 1e-4
    assert rms(plain.estimate) > 0.05
    judged = minimum_entropy(image)
    assert judged.status is Status.not_improved, judged.summary()
    assert judged.image is image
    assert not judged.phase_error.any()


def test_speckle_has_no_phase_to_find():
    """With an error of 1.5 rad on speckle, least entropy ends farther from the truth than it began, and is not believed."""
    error = 5 * X**2
    blurred = turned(scene(0, seed=5), error)
    plain = minimum_entropy(blurred, do_no_harm=False)
    assert sarfocus.quality.entropy(plain.image) < sarfocus.quality.entropy(blurred)
    assert rms(plain.phase_error - error) > 1.2 * rms(error)
    assert minimum_entropy(blurred).image is blurred


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("points", [0, 1, 3, 60])
@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_in_focus_comes_back_itself(method, points, seed):
    image = scene(points, n=96, m=96, seed=10 * points + seed)
    result = method(image)
    assert result.status is Status.not_improved, result.summary()
    assert result.image is image
    assert result.diagnostics["score"]["reason"]


def test_one_bright_point_is_focused():
    error = 10 * X**2
    result = minimum_entropy(turned(scene(1, peak_db=45.0, seed=1), error))
    assert not np.isfinite(result.phase_std).any()  # one half has nothing to say
    assert result.status in (Status.converged, Status.max_iterations), result.summary()
    assert rms(result.phase_error - error) < 0.15  # 24 dB a sample: bound 0.045 rad


def strip(points, seed=0, n=512, m=24):
    geometry = sarfocus.StripmapGeometry(
        wavelength=0.03, prf=240.0, velocity=100.0, slant_range=5000.0 + 1.5 * np.arange(m), doppler_bandwidth=200.0
    )
    rng = np.random.default_rng(seed)
    band = np.abs(np.fft.fftfreq(n, 1 / 240.0)) < 100.0
    noise = (rng.standard_normal((n, m)) + 1j * rng.standard_normal((n, m))) / np.sqrt(2)
    spectrum = np.fft.fft(noise, axis=0)
    for _ in range(points):
        a = 10 ** (32 / 20) * np.exp(2j * np.pi * rng.random())
        spectrum[:, rng.integers(m)] += a * np.exp(-2j * np.pi * np.fft.fftfreq(n) * rng.uniform(20, n - 20))
    return np.fft.ifft(spectrum * band[:, None], axis=0).astype(np.complex64), geometry


@pytest.mark.parametrize("method", METHODS)
def test_strips_have_their_phase_over_slow_time(method):
    image, geometry = strip(40)
    t = np.linspace(-1, 1, 512, endpoint=False)
    error = 12 * t**2 + 1.5 * np.cos(9 * t)
    raw = sarfocus.azimuth_decompress(image, geometry) * np.exp(1j * error)[:, None].astype(np.complex64)
    blurred = sarfocus.azimuth_compress(raw.astype(np.complex64), geometry)
    result = method(blurred, geometry)
    assert result.status in (Status.converged, Status.max_iterations), result.summary()
    inner = slice(20, -20)  # hardly any aperture lies wholly within reach of the ends
    assert rms((result.phase_error - error)[inner]) < 0.2  # 40 points, of which each sample sees three quarters at 8 dB
    entropy = sarfocus.quality.entropy
    assert entropy(blurred) - entropy(result.image) > 0.9 * (entropy(blurred) - entropy(image))
    again = method(image, geometry)
    assert again.image is image


@pytest.mark.parametrize("method", METHODS)
def test_same_bits_for_any_strides_and_threads(method):
    blurred = turned(scene(30), ERRORS["quadratic 5"])[:, :75]
    expected = method(blurred.copy(), threads=1)
    for other in (np.asfortranarray(blurred), np.repeat(blurred, 2, axis=1)[:, ::2], blurred[::-1].copy()[::-1]):
        again = method(other, threads=2)
        np.testing.assert_array_equal(again.image, expected.image)
        np.testing.assert_array_equal(again.phase_error, expected.phase_error)


def test_odd_sizes_and_many_gates():
    image = scene(200, n=601, m=1401, peak_db=38.0)
    result = minimum_entropy(turned(image, 4 * np.linspace(-1, 1, 601, endpoint=False) ** 2), polynomial=2, search=8.0, free_rounds=6)
    assert result.status in (Status.converged, Status.max_iterations), result.summary()
    assert rms(result.phase_error - 4 * np.linspace(-1, 1, 601, endpoint=False) ** 2) < 0.1


@pytest.mark.parametrize("shape", [(64, 1), (16, 40), (17, 3)])
def test_small_images_are_handled(shape):
    image = scene(1, *shape, seed=3)
    result = minimum_entropy(image)
    assert result.image.shape == result.image.shape == shape
    assert result.phase_error.shape == shape[:1]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("image", "error", "message"),
    [
        (np.zeros((64, 64), np.complex64), sarfocus.NumericalError, "zero"),
        (np.full((64, 64), np.nan, np.complex64), sarfocus.NumericalError, r"\[0, 0\]"),
        (np.ones((8, 64), np.complex64), sarfocus.ShapeError, "at least 16 azimuth lines"),
        (np.ones((64, 64), np.complex128), TypeError, "complex64"),
    ],
)
def test_refusals(method, image, error, message):
    with pytest.raises(error, match=message):
        method(image)


def test_options_are_checked():
    image, geometry = strip(3)
    for wrong in ({"polynomial": 0}, {"search": -1.0}, {"free_rounds": -1}, {"smooth_rounds": -1}, {"tolerance": 0.0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            minimum_entropy(image, **wrong)
    with pytest.raises(sarfocus.ShapeError, match="slant_range"):
        minimum_entropy(image[:, :5].copy(), geometry)
    with pytest.raises(TypeError, match="geometry"):
        minimum_entropy(image, 3.0)


def test_progress_can_stop_it():
    with pytest.raises(sarfocus.Cancelled):
        minimum_entropy(scene(30), progress=lambda *_: False)

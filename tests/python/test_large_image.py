"""pga and adaptive_pga of images beyond a million pixels, which are never looked at as a whole."""

import subprocess
import sys

import numpy as np
import pytest

import sarfocus
from sarfocus import Status

SHAPE = (1536, 1024)


def smooth_error(n, rms, seed=1):
    rng = np.random.default_rng(seed)
    u = np.linspace(-1, 1, n)
    phase = sum(rng.standard_normal() * np.cos(k * np.pi * (u + 1) / 2) for k in range(2, 9))
    phase -= np.polyval(np.polyfit(u, phase, 1), u)
    return rms * phase / phase.std()


def scene(phase, peak_db=30.0, every=4, seed=1):
    """Speckle of power one with a point in every so many range gates, the phase on its spectrum."""
    n, m = SHAPE
    rng = np.random.default_rng(seed)
    image = (rng.standard_normal((n, m)) + 1j * rng.standard_normal((n, m))) / np.sqrt(2)
    gates = np.arange(0, m, every)
    image[rng.integers(n // 8, 7 * n // 8, len(gates)), gates] += 10 ** (peak_db / 20) * np.exp(2j * np.pi * rng.random(len(gates)))
    spectrum = np.fft.fft(image, axis=0) * np.exp(1j * np.fft.ifftshift(phase))[:, None]
    return np.fft.ifft(spectrum, axis=0).astype(np.complex64)


def residual(result, phase):
    """RMS of what is left, rad, a line and whole turns aside."""
    rest = np.exp(1j * (result.phase_error - phase))
    x = np.arange(len(rest))
    spectrum = np.fft.fft(rest, 16 * len(rest))
    peak = int(np.argmax(np.abs(spectrum)))
    rest = np.angle(rest * np.exp(-2j * np.pi * peak * x / len(spectrum)) / spectrum[peak])
    return float(np.std(rest - np.polyval(np.polyfit(x, rest, 1), x)))


def returned(result):
    return result.status in (Status.not_improved, Status.no_strong_points)


@pytest.fixture(scope="module")
def smooth():
    phase = smooth_error(SHAPE[0], 4.9)
    return scene(phase), phase


@pytest.mark.parametrize("method", [sarfocus.pga, sarfocus.adaptive_pga])
def test_a_smooth_error_is_found_beyond_what_each_pulse_tells(method, smooth):
    image, phase = smooth
    result = method(image)
    assert result.status is Status.converged
    # 256 points of 1000 over 1536 pulses: 0.055 rad a pulse; the eight cosines of the error take a hundredth of the noise with them.
    assert residual(result, phase) < 0.015
    stated = float(np.sqrt(np.nanmean(result.phase_std**2)))
    assert stated < 0.03


def test_an_error_without_smoothness_is_found_as_well_as_the_points_allow():
    phase = np.random.default_rng(3).standard_normal(SHAPE[0])
    result = sarfocus.pga(scene(phase))
    assert result.status in (Status.converged, Status.max_iterations)
    assert residual(result, phase) < 1.3 * 0.055  # the bound of above, with the scatter of gates that hold two points' sidelobes


def test_weak_points_get_more_effort():
    """The quick way fails here: the second attempt, with more points and iterations, must take over."""
    phase = smooth_error(SHAPE[0], 4.9, seed=2)
    result = sarfocus.pga(scene(phase, peak_db=22.0, seed=2))
    assert not returned(result)
    assert residual(result, phase) < 0.03


@pytest.mark.parametrize("method", [sarfocus.pga, sarfocus.adaptive_pga])
def test_an_image_in_focus_and_one_of_speckle_alone_come_back(method):
    focused = scene(np.zeros(SHAPE[0]))
    rng = np.random.default_rng(4)
    speckle = (rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)).astype(np.complex64)
    for image in (focused, speckle):
        result = method(image)
        assert returned(result)
        assert result.image is image


@pytest.mark.parametrize("layout", ["fortran", "reversed", "strided"])
def test_same_bits_for_any_strides_and_threads(layout, smooth):
    image = smooth[0]
    expected = sarfocus.pga(image, threads=1)
    other = {
        "fortran": np.asfortranarray(image),
        "reversed": image[::-1].copy()[::-1],
        "strided": np.repeat(image, 2, axis=1)[:, ::2],
    }[layout]
    for threads in (1, 2, 3):
        result = sarfocus.pga(other, threads=threads)
        np.testing.assert_array_equal(result.phase_error, expected.phase_error)
        np.testing.assert_array_equal(result.image, expected.image)


def test_a_sample_that_is_no_number_is_named(smooth):
    broken = smooth[0].copy()
    broken[1000, 700] = np.nan
    with pytest.raises(sarfocus.NumericalError, match=r"1000.*700"):
        sarfocus.pga(broken)


MEMORY = """
import resource, sys
import numpy as np, sarfocus
rng = np.random.default_rng(1)
n = int(sys.argv[2])
image = rng.standard_normal((n, 2 * 2048), dtype=np.float32).view(np.complex64)
image[rng.integers(n // 12, 11 * n // 12, 512), np.arange(0, 2048, 4)] += 45
spectrum = np.fft.fft(image, axis=0)
spectrum *= np.exp(12j * np.linspace(-1, 1, n) ** 2)[:, None]
image = np.fft.ifft(spectrum, axis=0).astype(np.complex64)
del spectrum
out = np.ones_like(image)
sarfocus.autofocus(image[:64, :64].copy())  # what any first call loads
open("/proc/self/clear_refs", "w").write("5")
def status(key):
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith(key)) * 1024
before = status("VmRSS")
result = getattr(sarfocus, sys.argv[1])(image, out=out)
assert result.phase_error.any(), result.summary()
print((status("VmHWM") - before) / image.nbytes)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the peak of the process's memory from /proc")
@pytest.mark.parametrize(
    ("method", "lines"),
    [
        ("pga", 4096),
        ("adaptive_pga", 4096),
        ("conventional_pga", 2048),
        ("minimum_entropy", 2048),
        ("maximum_contrast", 2048),
        ("pga_2d", 2048),
        ("autofocus", 2048),
    ],
)
def test_peak_memory_stays_below_that_of_the_image(method, lines):
    done = subprocess.run([sys.executable, "-c", MEMORY, method, str(lines)], capture_output=True, text=True, check=True, timeout=300)
    assert float(done.stdout) < 1.0

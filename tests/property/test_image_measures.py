"""What must hold of the measures of a whole image, whatever the image."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from reference import quality as oracle
from sarfocus import NumericalError, ShapeError, quality

MEASURES = ["entropy", "entropy_log10", "contrast", "sharpness"]


@st.composite
def images(draw: st.DrawFn) -> NDArray[np.complex64]:
    """Speckle with a few bright points, seen through arbitrary strides: transposed, reversed, every second sample."""
    rows, columns = draw(st.integers(1, 40)), draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    full = rng.normal(size=(2 * rows, 2 * columns)) + 1j * rng.normal(size=(2 * rows, 2 * columns))
    full[rng.integers(2 * rows), rng.integers(2 * columns)] *= 10.0 ** draw(st.integers(0, 6))
    image = full.astype(np.complex64)[:: draw(st.sampled_from([1, 2, -1, -2])), :: draw(st.sampled_from([1, 2, -1, -2]))]
    return image.T if draw(st.booleans()) else image


@settings(deadline=None, max_examples=60)
@given(images(), st.sampled_from(MEASURES))
def test_measures_agree_with_the_equations(image: NDArray[np.complex64], name: str) -> None:
    expected = getattr(oracle, name)(image)
    # Both sum at most 6400 float64 terms; ln of intensities up to 1e12 loses two digits where they cancel in the entropy.
    assert getattr(quality, name)(image) == pytest.approx(expected, rel=1e-9, abs=1e-11)


@settings(deadline=None, max_examples=30)
@given(images(), st.sampled_from(MEASURES), st.integers(1, 4))
def test_measures_are_the_same_bits_for_any_threads_and_layout(image: NDArray[np.complex64], name: str, threads: int) -> None:
    measure = getattr(quality, name)
    assert measure(image, threads=threads) == measure(np.ascontiguousarray(image), threads=1)


@settings(deadline=None, max_examples=30)
@given(images(), st.sampled_from(MEASURES), st.integers(-60, 60), st.integers(0, 40), st.floats(-3, 3))
def test_measures_know_neither_scale_nor_place_nor_phase(
    image: NDArray[np.complex64], name: str, exponent: int, shift: int, phase: float
) -> None:
    measure = getattr(quality, name)
    # A power of two and a circular shift change no sample's mantissa, only the order of the sums.
    moved = np.roll(image * np.float32(2.0**exponent), shift, axis=(0, 1)).astype(np.complex64)
    assert measure(moved) == pytest.approx(measure(image), rel=1e-9, abs=1e-11)
    # A rotation rounds every sample to 24 bits.
    rotated = (image * np.exp(1j * phase)).astype(np.complex64)
    assert measure(rotated) == pytest.approx(measure(image), rel=1e-5, abs=1e-5)


@settings(deadline=None, max_examples=30)
@given(images(), st.integers(0, 2**32))
def test_psnr_agrees_with_the_equation(image: NDArray[np.complex64], seed: int) -> None:
    noise = np.random.default_rng(seed).normal(scale=0.1, size=image.shape)
    noisy = (image + noise).astype(np.complex64)
    # Differences of float64 square roots of float32 samples: at least nine digits remain of a difference of 1e-1 in 1e6.
    assert quality.psnr(noisy, image) == pytest.approx(oracle.psnr(noisy, image), rel=1e-7, abs=1e-7)


def test_speckle_has_the_entropy_the_theory_says() -> None:
    rng = np.random.default_rng(3)
    image = (rng.normal(size=(1024, 1024)) + 1j * rng.normal(size=(1024, 1024))).astype(np.complex64)
    # Mean of -x ln x for an exponential x of mean 1 is -(1 - gamma); the mean over 2^20 pixels scatters by about 1e-3.
    assert quality.entropy(image) == pytest.approx(np.log(image.size) - (1 - np.euler_gamma), abs=5e-3)
    assert quality.entropy_log10(image) == pytest.approx(quality.entropy(image) / np.log(10), rel=1e-15)
    assert quality.contrast(image) == pytest.approx(1.0, abs=1e-2)  # standard error of the contrast 2e-3


def test_what_cannot_be_measured_is_refused_with_a_clear_line() -> None:
    zeros = np.zeros((4, 5), np.complex64)
    bad = zeros.copy()
    bad[2, 3] = np.inf
    for name in MEASURES:
        with pytest.raises(NumericalError, match="image: expected at least one sample different from zero"):
            getattr(quality, name)(zeros)
        with pytest.raises(NumericalError, match=r"\[2, 3\]"):
            getattr(quality, name)(bad)
        with pytest.raises(TypeError, match="complex64"):
            getattr(quality, name)(zeros.astype(np.complex128))
        with pytest.raises(ValueError, match="2 dimensions"):
            getattr(quality, name)(zeros[0])
    with pytest.raises(ShapeError, match="reference"):
        quality.psnr(zeros, zeros[:, 1:])
    with pytest.raises(NumericalError, match="reference"):
        quality.psnr(np.ones_like(zeros), zeros)
    assert quality.psnr(np.ones_like(zeros), 1j * np.ones_like(zeros)) == np.inf

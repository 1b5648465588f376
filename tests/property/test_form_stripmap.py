"""What must hold of form_stripmap, whatever the echo."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import sarfocus

SPACING = 299_792_458.0 / (2 * 60e6)
FAST_TIME = {"range_start": 3000.0, "range_sampling": 60e6}


@st.composite
def strips(draw: st.DrawFn) -> tuple[NDArray[np.complex64], sarfocus.StripmapGeometry]:
    """An echo of any size and some geometry that the algorithm bears, the gates anywhere in what was recorded."""
    n_pulse, n_fast_time, n_range = draw(st.integers(2, 150)), draw(st.integers(8, 60)), draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    echo = rng.normal(size=(n_pulse, 2 * n_fast_time)).astype(np.float32).view(np.complex64)
    gates = np.sort(rng.uniform(0, n_fast_time - 2.5, n_range)) + 1e-3 * np.arange(n_range)
    geometry = sarfocus.StripmapGeometry(
        wavelength=0.05,
        prf=450.0,
        velocity=100.0,
        slant_range=3000.0 + SPACING * gates,
        doppler_bandwidth=draw(st.sampled_from([230.0, 400.0, 450.0])),
        doppler_centroid=draw(st.sampled_from([0.0, 120.0, -171.3])),
    )
    return echo, geometry


def largest(x: NDArray[np.complex64]) -> float:
    return float(np.abs(x).max())


@settings(deadline=None, max_examples=40)
@given(strips(), st.integers(0, 200))
def test_a_shift_along_azimuth_shifts_the_image(strip: tuple[NDArray[np.complex64], sarfocus.StripmapGeometry], shift: int) -> None:
    echo, geometry = strip
    image = sarfocus.form_stripmap(echo, geometry, **FAST_TIME)
    shifted = sarfocus.form_stripmap(np.roll(echo, shift, axis=0), geometry, **FAST_TIME)
    # Single-precision transforms of at most 150 and 100 samples of size 1.4, several of them in a row.
    assert largest(shifted - np.roll(image, shift, axis=0)) < 1e-5


@settings(deadline=None, max_examples=40)
@given(strips(), st.integers(-40, 40), st.floats(-3, 3))
def test_scale_and_phase_pass_through(strip: tuple[NDArray[np.complex64], sarfocus.StripmapGeometry], exponent: int, phase: float) -> None:
    echo, geometry = strip
    image = sarfocus.form_stripmap(echo, geometry, **FAST_TIME)
    scale = np.float32(2.0**exponent)  # no mantissa changes
    assert np.array_equal(sarfocus.form_stripmap(echo * scale, geometry, **FAST_TIME), image * scale)
    turned = sarfocus.form_stripmap((echo * np.exp(1j * phase)).astype(np.complex64), geometry, **FAST_TIME)
    assert largest(turned - image * np.exp(1j * phase)) < 1e-5  # rounding of the samples and of the transforms


@settings(deadline=None, max_examples=40)
@given(strips())
def test_no_gate_depends_on_which_others_are_asked_for(strip: tuple[NDArray[np.complex64], sarfocus.StripmapGeometry]) -> None:
    echo, geometry = strip
    image = sarfocus.form_stripmap(echo, geometry, **FAST_TIME)
    fields = {name: getattr(geometry, name) for name in ("wavelength", "prf", "velocity", "doppler_bandwidth", "doppler_centroid")}
    some = sarfocus.StripmapGeometry(**fields, slant_range=geometry.slant_range[::2])
    # Other references of secondary range compression: 1e-3 rad at the edges of the range band, samples of size 1.4.
    assert largest(sarfocus.form_stripmap(echo, some, **FAST_TIME) - image[:, ::2]) < 1e-2


@settings(deadline=None, max_examples=40)
@given(strips())
def test_decompress_and_compress_give_the_image_back(strip: tuple[NDArray[np.complex64], sarfocus.StripmapGeometry]) -> None:
    echo, geometry = strip
    image = sarfocus.form_stripmap(echo, geometry, **FAST_TIME)
    back = sarfocus.azimuth_compress(sarfocus.azimuth_decompress(image, geometry), geometry)
    assert np.linalg.norm(back - image) <= 1e-6 * np.linalg.norm(image)  # the promise of azimuth.hpp

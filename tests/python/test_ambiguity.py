"""sarfocus.quality.azimuth_ambiguity_ratio on images whose ambiguities are known."""

import numpy as np
import pytest

from sarfocus import NumericalError, StripmapGeometry, quality

GEOMETRY = StripmapGeometry(
    wavelength=0.03, prf=400.0, velocity=150.0, slant_range=20e3 + 3.0 * np.arange(64), doppler_bandwidth=300.0, doppler_centroid=0.0
)


def test_geometry_says_where_the_ambiguities_are() -> None:
    # A target of azimuth frequency f lies prf further in a spectrum sampled at prf: prf / K in time, prf^2 / K in samples.
    expected = GEOMETRY.prf**2 / GEOMETRY.fm_rate(40)
    offset = quality.azimuth_ambiguity_offset(prf=400.0, wavelength=0.03, velocity=150.0, slant_range=GEOMETRY.slant_range[40])
    assert offset == pytest.approx(expected, rel=1e-12)
    image = np.zeros((6000, 64), np.complex64)
    image[3000, 40] = 2j
    image[3000 + round(expected), 40] = 0.02
    image[3000 - round(expected) + 5, 45] = 0.002j
    highest, each = quality.azimuth_ambiguity_ratio(image, (3000, 40), geometry=GEOMETRY)
    np.testing.assert_allclose(each, [-60.0, -40.0], atol=1e-4)  # samples of 24 bits
    assert highest == each.max()
    np.testing.assert_array_equal(quality.azimuth_ambiguity_ratio(image, (3000, 40), [-expected, expected])[1], each)
    _, energy = quality.azimuth_ambiguity_ratio(np.asfortranarray(image), (3000, 40), geometry=GEOMETRY, measure="energy")
    np.testing.assert_allclose(energy, each, atol=1e-4)  # single pixels: the energy is the peak


def test_refusals_name_the_argument() -> None:
    image = np.zeros((600, 64), np.complex64)
    image[300, 30] = 1
    with pytest.raises(ValueError, match="offsets: expected either offsets or a geometry, got none"):
        quality.azimuth_ambiguity_ratio(image, (300, 30))
    with pytest.raises(ValueError, match="offsets: expected either offsets or a geometry, got both"):
        quality.azimuth_ambiguity_ratio(image, (300, 30), [100.0], geometry=GEOMETRY)
    with pytest.raises(ValueError, match="inside the image"):
        quality.azimuth_ambiguity_ratio(image, (300, 30), geometry=GEOMETRY)
    with pytest.raises(ValueError, match="measure"):
        quality.azimuth_ambiguity_ratio(image, (300, 30), 100.0, measure="mean")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="position"):
        quality.azimuth_ambiguity_ratio(image, (300, np.inf), 100.0)
    with pytest.raises(NumericalError, match="only zeros"):
        quality.azimuth_ambiguity_ratio(image, (100, 30), 100.0)

"""What interpolating between range samples errs by, against the echo itself: the figures of backproject.hpp."""

import numpy as np
import pytest

from sarfocus import backproject_histories

WAVELENGTH, SPACING, FIRST = 0.03, 0.5, 1000.0
N_RANGE, N_RECORD, N_POINT = 600, 40, 200


def error_db(share: float, fade: int, inside: int) -> float:
    """Of noise in `share` of the band sampled, between samples `inside` and more from both ends; sums of sinusoids are known anywhere."""
    rng = np.random.default_rng(11)
    period = 8 * N_RANGE  # of the noise: the record is cut from it
    k = np.arange(-int(share * period / 2) + 1, int(share * period / 2))
    error = power = 0.0
    for _ in range(N_RECORD):
        amplitude = rng.standard_normal(len(k)) + 1j * rng.standard_normal(len(k))
        place = rng.uniform(inside, N_RANGE - 1 - inside, N_POINT)

        def echo(sample: np.ndarray, amplitude: np.ndarray = amplitude) -> np.ndarray:
            edge = np.minimum(sample + 0.5, N_RANGE - 0.5 - sample)
            window = np.sin(0.5 * np.pi * np.clip(edge / fade, 0, 1)) ** 2 if fade else 1.0
            return np.exp(2j * np.pi * np.outer(sample, k) / period) @ amplitude * window

        points = np.c_[np.zeros(N_POINT), FIRST + SPACING * place, np.zeros(N_POINT)]
        data = echo(np.arange(N_RANGE)).astype(np.complex64)[None]
        found = backproject_histories(data, np.zeros((1, 3)), points, range_start=FIRST, range_spacing=SPACING, wavelength=WAVELENGTH)[
            :, 0
        ] * np.exp(-4j * np.pi * points[:, 1] / WAVELENGTH)
        truth = echo(place)
        error += float(np.sum(np.abs(found - truth) ** 2))
        power += float(np.sum(np.abs(truth) ** 2))
    return 10 * np.log10(error / power)


@pytest.mark.parametrize(
    ("share", "fade", "inside", "stated"),
    [
        (0.7, 32, 0, -80),
        (1 / 1.2, 32, 0, -73),
        (0.9, 32, 0, -68),
        (0.95, 32, 0, -55),
        (1.0, 32, 0, -30),
        (1 / 1.2, 0, 0, -40),
        (1 / 1.2, 0, 16, -51),
        (1 / 1.2, 0, 64, -57),
    ],
)
def test_the_stated_error_between_samples(share: float, fade: int, inside: int, stated: float) -> None:
    # Where the noise at the last samples decides, 80 ends of records scatter by a decibel or two.
    assert error_db(share, fade, inside) == pytest.approx(stated, abs=2.5)

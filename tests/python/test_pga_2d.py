"""pga_2d and its correction against displacements of the path, turned into echoes independently (tests/reference/migration.py)."""

import numpy as np
import pytest

import sarfocus
from reference import migration
from sarfocus import Status, correct_two_dimensional, pga, pga_2d

N = 160
RATIO = migration.SAMPLING / migration.CARRIER
X = np.linspace(-1, 1, N, endpoint=False)
RADIANS = 4 * np.pi * migration.CARRIER / migration.SPEED_OF_LIGHT  # a metre of path, two ways


def without_line(phase):
    x = np.arange(len(phase))
    return phase - np.polyval(np.polyfit(x, phase, 1), x)


SHAPES = {"60 rad quadratic": 60 * X**2, "40 rad of order 4": 40 * X**4, "80 rad cubic": 80 * X**3}
BIG = {name: without_line(shape) for name, shape in SHAPES.items()}


def places(count, n=N, seed=3):
    rng = np.random.default_rng(seed)
    return np.c_[rng.uniform(0.1 * n, 0.9 * n, count), rng.uniform(0.1 * n, 0.9 * n, count)]


def still(u, f):
    return 0.0 * u * f


def blurred(phase, points, **scene):
    """Image with the path error -phase / RADIANS while each azimuth frequency is seen, and the image without."""
    path = np.fft.ifftshift(-phase / RADIANS)[:, None]
    n = len(phase)
    return (
        migration.image(points, lambda u, f: path + 0 * f, n, n, **scene),
        migration.image(points, still, n, n, **scene),
    )


def peak_loss_db(image, clean, points):
    """Mean loss of the points' peaks, each the strongest pixel within two of its place in the image that never had an error."""
    loss = []
    for azimuth, gate in np.rint(points).astype(int):
        box = np.s_[azimuth - 2 : azimuth + 3, gate - 2 : gate + 3]
        at = np.unravel_index(np.abs(clean[box]).argmax(), (5, 5))
        loss.append(20 * np.log10(np.abs(clean[box][at]) / np.abs(image[box][at])))
    return float(np.mean(loss))


@pytest.mark.parametrize("name", list(BIG))
@pytest.mark.parametrize("ratio", [RATIO, None], ids=["given", "found"])
def test_points_smeared_through_range_come_to_a_focus(name, ratio):
    points = places(40)
    image, clean = blurred(BIG[name], points)
    assert np.ptp(BIG[name]) * RATIO / (2 * np.pi) > 1.9  # range gates of migration
    alone = pga(image)
    assert peak_loss_db(alone.image, clean, points) > 1.0
    result = pga_2d(image, bandwidth_ratio=ratio)
    assert result.status in (Status.converged, Status.max_iterations), result.summary()
    assert np.std(without_line(result.phase_error - BIG[name])) < 0.05
    # A shift of a hundredth of a pixel, the gauge's, changes a pixel by far less than 0.1 dB.
    assert abs(peak_loss_db(result.image, clean, points)) < 0.1
    found = result.diagnostics["migration"]
    assert found["estimated"] is (ratio is None)
    # The range moved by a wrong ratio stays below a twentieth of a gate.
    assert abs(found["bandwidth_ratio"] - RATIO) * np.ptp(BIG[name]) / (2 * np.pi) < 0.05
    assert "bandwidth ratio" in result.summary()


def test_the_correction_undoes_the_displacement_and_has_its_sign():
    points = places(20)
    phase = BIG["60 rad quadratic"]
    image, clean = blurred(phase, points)
    scale = np.abs(clean).max()
    # Phases to 2e-7 of 60 rad, transforms in single precision.
    np.testing.assert_allclose(correct_two_dimensional(image, phase, RATIO), clean, atol=2e-5 * scale)
    assert peak_loss_db(correct_two_dimensional(image, phase, -RATIO), clean, points) > 3.0
    assert peak_loss_db(correct_two_dimensional(image, phase, 0.0), clean, points) > 3.0
    assert peak_loss_db(correct_two_dimensional(image, phase, 0.7 * RATIO), clean, points) > 0.3


def test_a_wrong_sign_of_the_ratio_leaves_the_smear():
    points = places(40)
    image, clean = blurred(BIG["60 rad quadratic"], points)
    assert peak_loss_db(pga_2d(image, bandwidth_ratio=-RATIO).image, clean, points) > 1.0
    # Range falling with the gate: the same echo with its range axis turned round has the negative ratio, and that is found.
    turned = np.roll(image[:, ::-1], 1, axis=1)
    assert pga_2d(turned).diagnostics["migration"]["bandwidth_ratio"] == pytest.approx(-RATIO, rel=0.03)


def test_polar_format_images_have_the_error_along_rays():
    points = places(40)
    # The displacement belongs to the angle u f_c / f; quadratic in it, 60 rad for the carrier, without the mean
    # that would move the range axis.
    displacement = lambda u, f: -60 * ((2 * u * migration.CARRIER / f) ** 2 - 1 / 3) / RADIANS  # noqa: E731
    image = migration.image(points, displacement, N, N)
    clean = migration.image(points, still, N, N)
    phase = 60 * (X**2 - 1 / 3)
    # Between samples the cubic is exact for a quadratic; beyond the ends of the aperture a line goes on where the parabola does.
    loss = peak_loss_db(correct_two_dimensional(image, phase, RATIO, model="polar_format"), clean, points)
    assert abs(loss) < 0.3
    result = pga_2d(image, bandwidth_ratio=RATIO, model="polar_format")
    # The line that is taken off the phase, for the gauge, shifts every point by a quarter of a pixel, so peaks can't be compared.
    in_gauge = correct_two_dimensional(image, without_line(phase), RATIO, model="polar_format")
    # The outer range frequencies see the error stretched beyond what pulses tell: 0.2 rad are left here, 0.3 nat.
    inner = np.abs(X) < 0.85
    assert np.std(without_line((result.phase_error - phase)[inner])) < 0.3
    entropy = sarfocus.quality.entropy
    assert entropy(result.image) < entropy(in_gauge) + 0.4
    assert entropy(result.image) < entropy(pga(image).image) - 0.5
    assert entropy(result.image) < entropy(pga_2d(image, bandwidth_ratio=RATIO).image) - 0.5


def test_small_errors_are_as_with_pga():
    image, _ = blurred(without_line(2 * X**2 + np.sin(7 * X)), places(40))
    alone = sarfocus.quality.entropy(pga(image).image)
    assert sarfocus.quality.entropy(pga_2d(image).image) < alone + 5e-4
    assert sarfocus.quality.entropy(pga_2d(image, bandwidth_ratio=RATIO).image) < alone + 5e-4
    assert pga_2d(image).diagnostics["migration"]["bandwidth_ratio"] == 0.0
    assert "no migration through range seen" in pga_2d(image).summary()


@pytest.mark.parametrize("count", [0, 1, 40])
@pytest.mark.parametrize("ratio", [None, RATIO])
def test_what_is_in_focus_comes_back_itself(count, ratio):
    image = migration.image(places(count), still, N, N, seed=count)
    result = pga_2d(image, bandwidth_ratio=ratio)
    assert result.status in (Status.not_improved, Status.no_strong_points)
    assert result.image is image
    assert not result.phase_error.any()
    out = np.zeros_like(image)
    np.testing.assert_array_equal(pga_2d(image, bandwidth_ratio=ratio, out=out).image, image)


def test_same_bits_for_any_strides_and_threads():
    points = places(20, 96)
    image, _ = blurred(without_line(40 * np.linspace(-1, 1, 97) ** 2), points)
    image = image[:, :75]
    expected = pga_2d(image.copy(), threads=1)
    for other in (np.asfortranarray(image), np.repeat(image, 2, axis=1)[:, ::2], image[::-1].copy()[::-1]):
        again = pga_2d(other, threads=2)
        np.testing.assert_array_equal(again.image, expected.image)
        np.testing.assert_array_equal(again.phase_error, expected.phase_error)


@pytest.mark.parametrize(
    ("image", "error", "message"),
    [
        (np.zeros((64, 64), np.complex64), sarfocus.NumericalError, "all zero"),
        (np.full((64, 64), np.nan, np.complex64), sarfocus.NumericalError, r"\[0, 0\]"),
        (np.ones((8, 64), np.complex64), sarfocus.ShapeError, "at least 16 azimuth lines"),
        (np.ones((64, 64), np.complex128), TypeError, "complex64"),
    ],
)
def test_refusals(image, error, message):
    with pytest.raises(error, match=message):
        pga_2d(image, bandwidth_ratio=0.1)


def test_options_are_checked():
    image = np.ones((32, 32), np.complex64)
    for wrong in ({"bandwidth_ratio": 1.5}, {"bandwidth_ratio": float("nan")}, {"model": "chirp_scaling"}, {"passes": 0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            pga_2d(image, **wrong)
    with pytest.raises(sarfocus.ShapeError, match="phase"):
        correct_two_dimensional(image, np.zeros(31), 0.1)
    with pytest.raises(sarfocus.NumericalError, match="phase"):
        correct_two_dimensional(image, np.full(32, np.nan), 0.1)


def test_one_gate_is_handled():
    image, _ = blurred(without_line(5 * X**2), places(40))
    assert pga_2d(image[:, :1].copy()).phase_error.shape == (N,)

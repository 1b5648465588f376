"""Scenes that stripmap autofocus may not cope with: it must say so and hand back nothing that is worse than what it was given."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

import sarfocus
from reference.strip import without_line
from sarfocus import Status

N, GATES = 1024, 32
APERTURE = 208  # samples
SEEDS = (1, 2, 3)
IMPROVED = {Status.converged, Status.gaps}
ANY = IMPROVED | {Status.not_improved}


def geometry_of(mistuned: float = 0.0) -> sarfocus.StripmapGeometry:
    """Geometry of the strip; with K larger by a share where the echoes of moving targets are made."""
    return sarfocus.StripmapGeometry(
        wavelength=0.03125 / (1 + mistuned),
        prf=240.0,
        velocity=120.0,
        slant_range=4000 + 0.5 * np.arange(GATES),
        doppler_bandwidth=200.0,
    )


def smooth_phase(n: int = N) -> NDArray[np.float64]:
    x = np.arange(n) / n
    return 4 * (np.sin(6 * np.pi * x + 0.4) + 0.4 * np.cos(10.2 * np.pi * x))


def spread(count: int, seed: int, n: int = N) -> NDArray[np.float64]:
    """Points about evenly along azimuth, in as many gates as there are."""
    rng = np.random.default_rng(seed)
    azimuth = np.floor((np.arange(count) + rng.uniform(0.2, 0.8, count)) * n / count)
    return np.stack([azimuth, rng.permutation(max(count, GATES))[:count] % GATES], 1)


def echo(
    geometry: sarfocus.StripmapGeometry, points: NDArray[np.float64], db: float, *, n: int, seed: int, clutter: float
) -> NDArray[np.complex64]:
    """The strip before compression, points of random phases in clutter."""
    rng = np.random.default_rng(seed)
    amplitude = 10 ** (db / 20) * np.exp(2j * np.pi * rng.random(len(points)))
    return sarfocus.simulate.stripmap(geometry, points.reshape(-1, 2), amplitude, n_azimuth=n, clutter_power=clutter, seed=seed)


@dataclass
class Scene:
    """Points so many dB over clutter of power one, a phase error, moving targets (points, dB, share by which their K differs)."""

    points: NDArray[np.float64]
    db: float
    phase: NDArray[np.float64] = field(default_factory=smooth_phase)
    clutter: float = 1.0
    moving: tuple[NDArray[np.float64], float, float] | None = None

    def images(self, seed: int) -> tuple[NDArray[np.complex64], NDArray[np.complex64]]:
        """Give the strip in focus and with the error."""
        geometry = geometry_of()
        raw = echo(geometry, self.points, self.db, n=len(self.phase), seed=seed, clutter=self.clutter)
        if self.moving is not None:
            where, db, mistuned = self.moving
            raw = raw + echo(geometry_of(mistuned), where, db, n=len(self.phase), seed=seed + 100, clutter=0.0)
        blurred = (raw * np.exp(1j * self.phase)[:, None]).astype(np.complex64)
        return sarfocus.azimuth_compress(raw, geometry), sarfocus.azimuth_compress(blurred, geometry)

    def whole(self) -> NDArray[np.float64]:
        """Points whose aperture does not go on at the other end of the periodic strip."""
        azimuth = self.points[:, 0]
        return self.points[(azimuth > APERTURE / 2) & (azimuth < len(self.phase) - APERTURE / 2)]


def peaks_db(image: NDArray[np.complex64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Peaks within 40 pixels of the points, between the pixels: columns interpolated eightfold."""
    n = len(image)
    out = []
    for azimuth, gate in points.astype(int):
        spectrum = np.fft.fft(image[:, gate])
        fine = np.fft.ifft(np.concatenate([spectrum[: n // 2], np.zeros(7 * n), spectrum[n // 2 :]])) * 8
        near = fine[max(8 * (azimuth - 40), 0) : 8 * (azimuth + 40)]
        out.append(20 * np.log10(np.abs(near).max()))
    return np.array(out)


@dataclass
class Outcome:
    """What came of it."""

    result: sarfocus.Result
    entropy_gain: float  # nat
    peak_gain: float  # dB, mean of the points
    possible: float  # dB, of the image in focus
    rms: float  # rad, of the estimate where it is stated, less its line


def tried(scene: Scene, seed: int, statuses: set[Status], reason: str) -> Outcome:
    """Run it and check what must hold whatever the scene."""
    focused, blurred = scene.images(seed)
    kept = blurred.copy()
    result = sarfocus.spga_linear(blurred, geometry_of())
    np.testing.assert_array_equal(blurred, kept)
    score = result.diagnostics["score"]
    assert result.status in statuses, score["reason"]
    assert reason in score["reason"]
    if result.status in IMPROVED:
        assert score["improved"]
        assert sarfocus.quality.entropy(result.image) < sarfocus.quality.entropy(blurred)
    else:
        assert not score["improved"]
        np.testing.assert_array_equal(result.image, blurred)
        assert not result.phase_error.any()
    points = scene.whole()
    before, after, best = (peaks_db(image, points) for image in (blurred, result.image, focused))
    # Nothing worse: no peak is lower on average by more than a tenth of a decibel.
    assert points.size == 0 or (after - before).mean() > -0.1
    stated = np.isfinite(result.phase_std)
    return Outcome(
        result,
        sarfocus.quality.entropy(blurred) - sarfocus.quality.entropy(result.image),
        float((after - before).mean()) if points.size else 0.0,
        float((best - before).mean()) if points.size else 0.0,
        float(np.std(without_line((result.estimate - scene.phase)[stated]))) if stated.sum() > 10 else np.nan,
    )


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("db", "clutter"), [(40.0, 1.0), (30.0, 1.0), (30.0, 0.0)])
def test_one_point_alone(seed: int, db: float, clutter: float) -> None:
    scene = Scene(np.array([[500.0, 16.0]]), db, clutter=clutter)
    out = tried(scene, seed, {Status.gaps}, "no other point confirms it")
    # Its aperture is a fifth of the strip, and known as one line is: sqrt(1 / (2 SNR)) of some 30 independent samples.
    assert 0.7 * APERTURE < np.isfinite(out.result.phase_std).sum() < 1.3 * APERTURE
    assert out.peak_gain > out.possible - 0.5
    assert out.rms < 0.25


@pytest.mark.parametrize("seed", SEEDS)
def test_no_overlap_anywhere(seed: int) -> None:
    alone = Scene(np.array([[120.0, 3], [450, 9], [800, 20]]), 38.0)
    out = tried(alone, seed, {Status.gaps}, "no other point confirms it")
    assert out.result.diagnostics["strip"]["segments"] == 3
    assert out.peak_gain > out.possible - 0.5
    groups = Scene(
        np.array([[u + d, (3 + 5 * i + 11 * j) % GATES] for j, u in enumerate((110.0, 480, 860)) for i, d in enumerate((-20, 0, 20))]), 32.0
    )
    out = tried(groups, seed, {Status.gaps}, "other points gave")
    assert out.result.diagnostics["strip"]["segments"] >= 3
    assert out.peak_gain > out.possible - 1.0


@pytest.mark.parametrize("seed", SEEDS)
def test_all_points_in_one_gate(seed: int) -> None:
    scene = Scene(np.stack([np.linspace(30, 990, 16).round(), np.full(16, 12.0)], 1), 32.0)
    out = tried(scene, seed, {Status.converged}, "other points gave")
    assert out.peak_gain > out.possible - 0.5
    # Two to a window of 64 pixels: they may be told apart or not, but nothing gets worse.
    tried(Scene(np.stack([np.linspace(30, 990, 40).round(), np.full(40, 12.0)], 1), 32.0), seed, ANY, "")


@pytest.mark.parametrize("distance", [3, 8, 20, 40, 80])
@pytest.mark.parametrize("seed", SEEDS)
def test_two_equal_targets_in_an_aperture(seed: int, distance: int) -> None:
    shift = np.array([distance, 0.0])
    tried(Scene(np.concatenate([pair := np.array([[470.0, 12.0]]), pair + shift]), 38.0), seed, ANY, "")
    first = spread(12, seed)
    first = first[first[:, 0] + distance < N]
    tried(Scene(np.concatenate([first, first + shift]), 32.0), seed, ANY, "other points gave")


def test_a_phase_that_many_points_lose_by_is_not_applied() -> None:
    """Points with a twin each agree on a phase by which a quarter of them would fall by 3 to 6 dB."""
    first = spread(12, 4)
    pairs = np.concatenate([first, first + np.array([8.0, 0.0])])
    out = tried(Scene(pairs, 32.0), 4, {Status.not_improved}, "points that the phase rests on fall by more than 3 dB")
    assert out.result.diagnostics["score"]["held_out_gain"] > 3.0 * out.result.diagnostics["score"]["held_out_noise"]


@pytest.mark.parametrize("mistuned", [0.03, 0.1])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_moving_target_among_good_ones(seed: int, mistuned: float) -> None:
    points, place = spread(24, seed), np.array([[512.0, 8.0]])
    for db in (30.0, 40.0):  # as strong as the others, and ten times
        out = tried(Scene(points, 30.0, moving=(place, db, mistuned)), seed, {Status.converged}, "other points gave")
        assert out.peak_gain > out.possible - 1.0
    # A hundred times: what the correction does to it may be most of the entropy.
    tried(Scene(points, 30.0, moving=(place, 50.0, mistuned)), seed, ANY, "other points gave")
    # A third of all points, stronger than the others.
    crowd = np.array([[150.0 + 100 * i, (3 * i) % GATES] for i in range(8)])
    tried(Scene(points, 30.0, moving=(crowd, 33.0, mistuned)), seed, ANY, "other points gave")


@pytest.mark.parametrize("jumps", [1, 4])
@pytest.mark.parametrize("seed", SEEDS)
def test_phase_jumps_of_half_a_turn(seed: int, jumps: int) -> None:
    phase = np.pi * ((np.arange(N) * (jumps + 1) // N) % 2)
    out = tried(Scene(spread(32, seed), 30.0, phase), seed, ANY, "other points gave")
    if jumps == 4:
        assert out.result.status is Status.converged
        assert out.peak_gain > out.possible - 0.7


@pytest.mark.parametrize("n", [120, 160, 208])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_strip_shorter_than_an_aperture(seed: int, n: int) -> None:
    phase = 8 * np.linspace(-1, 1, n) ** 2
    few = tried(Scene(spread(8, seed, n), 33.0, phase), seed, ANY, "other points gave")
    many = tried(Scene(spread(30, seed, n), 33.0, phase), seed, {Status.converged}, "other points gave")
    # Every point sees all of the strip.
    assert few.rms < 0.15
    assert many.rms < 0.15


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_but_clutter(seed: int) -> None:
    nothing = np.zeros((0, 2))
    for phase in (smooth_phase(), np.zeros(N)):
        out = tried(Scene(nothing, 0.0, phase), seed, {Status.no_strong_points}, "no pixel stands out")
        assert len(out.result.points) == 0
        assert np.isnan(out.result.phase_std).all()


@pytest.mark.parametrize("db", [20.0, 25.0, 30.0, 45.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_no_error_and_many_points(seed: int, db: float) -> None:
    out = tried(Scene(spread(40, seed), db, np.zeros(N)), seed, {Status.not_improved}, "no more than chance would")
    assert len(out.result.points) >= 20
    assert out.rms < 0.6


@pytest.mark.parametrize("mistuned", [0.03, 0.1])
@pytest.mark.parametrize("seed", SEEDS)
def test_moving_targets_are_no_error_of_the_strip(seed: int, mistuned: float) -> None:
    crowd = np.array([[150.0 + 100 * i, (3 * i) % GATES] for i in range(8)])
    for moving, db in ((crowd[3:4], 45.0), (crowd, 33.0)):
        scene = Scene(spread(24, seed), 30.0, np.zeros(N), moving=(moving, db, mistuned))
        tried(scene, seed, {Status.not_improved}, "no more than chance would")


@pytest.mark.parametrize("seed", SEEDS)
def test_the_baseline_does_no_harm_either(seed: int) -> None:
    scenes = [
        Scene(np.array([[500.0, 16.0]]), 40.0),
        Scene(np.zeros((0, 2)), 0.0),
        Scene(spread(24, seed), 30.0, np.zeros(N)),
        Scene(np.array([[470.0, 12.0], [478.0, 12.0]]), 38.0),
    ]
    for scene in scenes:
        _, blurred = scene.images(seed)
        result = sarfocus.spga(blurred, geometry_of(), iterations=3)
        assert result.diagnostics["score"]["reason"]
        assert sarfocus.quality.entropy(result.image) <= sarfocus.quality.entropy(blurred)
        if result.status not in IMPROVED | {Status.max_iterations}:
            np.testing.assert_array_equal(result.image, blurred)
        points = scene.whole()
        assert points.size == 0 or (peaks_db(result.image, points) - peaks_db(blurred, points)).mean() > -0.1

"""Slow NumPy oracles of the simulator: echoes of points, Philox, the stripmap models; each written from its equation."""

import numpy as np
from numpy.typing import NDArray

C = 299_792_458.0
_WORD = np.uint64(0xFFFFFFFF)


def ranges(tx: NDArray[np.float64], rx: NDArray[np.float64], targets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the path transmitter - target - receiver, [n_pulse, n_target], m."""
    legs = [np.linalg.norm(targets[None] - antenna[:, None], axis=2) for antenna in (tx, rx)]
    return (legs[0] + legs[1]) / 2


def response(window: NDArray[np.float64], nu: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The transform of a window sampled at nu in [-1/2, 1/2], normalised to 1 at x = 0, by the trapezium rule."""
    weight = window * np.gradient(nu)
    weight[[0, -1]] /= 2 if abs(nu[0] + 0.5) < 1e-12 else 1
    return np.cos(2 * np.pi * x[..., None] * nu) @ weight / weight.sum()


def point_echoes(
    distance: NDArray[np.float64], reflectivity: NDArray[np.complex128], r: NDArray[np.float64], wavelength: float, bandwidth: float
) -> NDArray[np.complex128]:
    """sum of a exp(-4j pi R / lambda) sinc(2 B (r - R) / c): unweighted band, the convention of the contract. r: [n_pulse, n_range]."""
    delay = 2 * bandwidth * (r[:, :, None] - distance[:, None, :]) / C
    return np.einsum("pt,prt->pr", reflectivity * np.exp(-4j * np.pi * distance / wavelength), np.sinc(delay))


def philox(counter: NDArray[np.uint64], key: tuple[int, int]) -> NDArray[np.uint64]:
    """Philox4x32-10 [Salmon et al. 2011, section 4]: counter [..., 4] of 32-bit words, in 64-bit arithmetic."""
    x = [counter[..., i] & _WORD for i in range(4)]
    k0, k1 = (np.uint64(k) for k in key)
    for _ in range(10):
        a, b = np.uint64(0xD2511F53) * x[0], np.uint64(0xCD9E8D57) * x[2]
        x = [(b >> np.uint64(32)) ^ x[1] ^ k0, b & _WORD, (a >> np.uint64(32)) ^ x[3] ^ k1, a & _WORD]
        k0, k1 = (k0 + np.uint64(0x9E3779B9)) & _WORD, (k1 + np.uint64(0xBB67AE85)) & _WORD
    return np.stack(x, axis=-1)


def complex_normal(seed: int, stream: int, n: int) -> NDArray[np.complex128]:
    """The first n numbers of a stream: Marsaglia's polar method on (index, stream, attempt), mean square 1."""
    out = np.zeros(n, np.complex128)
    left = np.arange(n, dtype=np.uint64)
    attempt = 0
    while len(left):
        counter = np.stack([left & _WORD, left >> np.uint64(32), np.full_like(left, stream), np.full_like(left, attempt)], axis=-1)
        words = philox(counter, (seed & 0xFFFFFFFF, seed >> 32))
        bits = [((words[:, i] << np.uint64(32)) | words[:, i + 1]) >> np.uint64(11) for i in (0, 2)]
        x, y = (b.astype(np.float64) * 2.0**-52 - 1 for b in bits)
        square = x**2 + y**2
        good = (square < 1) & (square > 0)
        out[left[good]] = ((x + 1j * y) * np.sqrt(-np.log(np.where(good, square, 0.5)) / np.where(good, square, 1)))[good]
        left, attempt = left[~good], attempt + 1
    return out

"""One fixed-point step of the phase that makes an image sharper, written from its equation [Kragh 2006; Fienup 2000].

The sum of F(|x|^2) grows when pulse k takes the phase arg sum_n Y_kn conj(fft(w x)_kn), w = F'(|x|^2): I ln I for entropy (up to the
constant energy w = ln(I / mean I)), I^2 for contrast.
"""

import numpy as np


def fixed_point_step(image, measure):
    """rad over fftshift(fft(image, axis=0)), from no phase."""
    x = image.astype(complex)
    intensity = np.abs(x) ** 2
    weight = np.log(intensity / intensity.mean()) if measure == "entropy" else intensity
    pulses = np.fft.fft(x, axis=0)
    pull = (pulses * np.conj(np.fft.fft(weight * x, axis=0))).sum(axis=1)
    return np.fft.fftshift(np.angle(pull))

"""Files in, files out: phase histories and images, with the metadata that turn them into geometry.

`read` looks at extension and content: Gotcha ``.mat``, BWSI ``.npz``, ``.npy`` (a bare image), complex TIFF (a bare image; with the
annotation of Sentinel-1), and the package's own ``.npz`` and HDF5 (layout: `sarfocus.io.layout`). `write` knows ``.npy``, ``.npz`` and
HDF5; it writes beside the target and renames, so that a failure leaves an existing file as it was.
"""

from .bwsi import read_bwsi
from .dispatch import read, write
from .errors import FormatError
from .gotcha import read_gotcha
from .model import Image, PhaseHistory, Track

__all__ = ["FormatError", "Image", "PhaseHistory", "Track", "read", "read_bwsi", "read_gotcha", "write"]

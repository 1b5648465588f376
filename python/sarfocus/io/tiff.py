"""Complex TIFF: a bare image, with what the annotation of a Sentinel-1 product says where that lies beside it."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
import tifffile

from .errors import FormatError, reading
from .model import Image

SPEED_OF_LIGHT = 299792458.0
TOPS_MODES = ("IW", "EW")
TOPS = "TOPS: within a burst the beam is steered and the Doppler centroid sweeps; not a stripmap, no StripmapGeometry describes it"
TEXTS = {"sensor": "missionId", "product": "productType", "mode": "mode", "swath": "swath", "polarisation": "polarisation"}
FIGURES = {"azimuth_spacing": "azimuthPixelSpacing", "range_spacing": "rangePixelSpacing", "radar_frequency": "radarFrequency"}

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # what it remarks on a damaged file is in the error already


def read_tiff(path: Path) -> Image:
    """Read the one image of a TIFF file, complex integers included.

    An annotation is looked for beside the file and in the folder ``annotation`` of a product: the ``.xml`` of the same name, or the
    only one that begins with what stands before the first underscore of the name. That is how excerpts are called; where in the
    product one was cut is not known, so there are no slant ranges.

    Returns
    -------
    Image
        Complex64 [n_azimuth, n_range], lines as azimuth; ``geometry`` is None always. With an annotation: both spacings, and in
        ``metadata`` sensor, mode, swath, polarisation, wavelength (m) and ``acquisition``, which says so where the data are TOPS.

    Raises
    ------
    FormatError
        Not one complex image, or damaged.
    """
    data = _samples(path)
    annotation = _annotation_of(path)
    if annotation is None:
        return Image(data, metadata={"source": path.name})
    with reading(annotation):
        found = _annotated(annotation)
    if found is None:
        return Image(data, metadata={"source": path.name})
    spacings = {name: found.pop(name) for name in ("azimuth_spacing", "range_spacing")}
    return Image(data, metadata={"source": path.name, "annotation": annotation.name} | found, **spacings)


def _samples(path: Path) -> npt.NDArray[np.complex64]:
    with tifffile.TiffFile(path) as file:
        if len(file.pages) != 1:
            raise FormatError(f"expected one image, got {len(file.pages)}")
        page = file.pages.first
        if page.dtype is None or page.dtype.kind != "c" or len(page.shape) != 2:
            kind = "samples of an unknown kind" if page.dtype is None else str(page.dtype)
            raise FormatError(f"expected one complex sample a pixel, got {kind} of shape {page.shape}")
        end = max((start + size for start, size in zip(page.dataoffsets, page.databytecounts, strict=True)), default=0)
        if end > file.filehandle.size:
            raise FormatError(f"cut short: the image ends at byte {end}, the file at {file.filehandle.size}")
        stored = page.bitspersample * page.size // 8
        if page.compression == tifffile.COMPRESSION.NONE and stored > sum(page.databytecounts):
            raise FormatError(f"cut short: {page.shape} pixels are {stored} bytes, the file holds {sum(page.databytecounts)} of them")
        return page.asarray().astype(np.complex64, copy=False)


def _annotation_of(path: Path) -> Path | None:
    candidates = [*path.parent.glob("*.xml"), *(path.parent.parent / "annotation").glob("*.xml")]
    same = [candidate for candidate in candidates if candidate.stem == path.stem]
    begun = [candidate for candidate in candidates if candidate.stem.startswith(path.stem.partition("_")[0])]
    return same[0] if same else begun[0] if len(begun) == 1 else None


def _annotated(path: Path) -> dict[str, Any] | None:
    """Return what the annotation says; None where the file is another kind of XML."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise FormatError(f"damaged or cut short: {error}") from error
    if root.tag != "product" or root.find("adsHeader") is None:
        return None
    texts = {name: _text(root, f"adsHeader/{tag}") for name, tag in TEXTS.items()}
    figures = {name: float(_text(root, f".//{tag}")) for name, tag in FIGURES.items()}
    acquisition = TOPS if texts["mode"] in TOPS_MODES else f"mode {texts['mode']}"
    wavelength = SPEED_OF_LIGHT / figures.pop("radar_frequency")
    return texts | figures | {"start_time": _text(root, "adsHeader/startTime"), "wavelength": wavelength, "acquisition": acquisition}


def _text(root: ElementTree.Element, path: str) -> str:
    text = root.findtext(path)
    if text is None:
        raise FormatError(f"the element «{path.rpartition('/')[2]}» is missing")
    return text.strip()

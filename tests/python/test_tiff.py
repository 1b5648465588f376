"""Complex TIFF: what is stored comes back, annotation is found, TOPS is said to be TOPS, everything else is refused in one line."""

import numpy as np
import pytest
import tifffile

from sarfocus.io import FormatError, read

ANNOTATION = """<?xml version="1.0"?>
<product>
  <adsHeader><missionId>S1A</missionId><productType>SLC</productType><polarisation>VV</polarisation><mode>{mode}</mode><swath>IW3</swath>
    <startTime>2022-09-18T07:49:21.5</startTime></adsHeader>
  <generalAnnotation><productInformation><radarFrequency>5.405e9</radarFrequency></productInformation></generalAnnotation>
  <imageAnnotation><imageInformation><rangePixelSpacing>2.3</rangePixelSpacing><azimuthPixelSpacing>13.9</azimuthPixelSpacing>
  </imageInformation></imageAnnotation>
</product>"""


def samples(shape=(7, 5)):
    generator = np.random.default_rng(1)
    return generator.integers(-32768, 32768, (*shape, 2), dtype=np.int16)


def write_complex_int16(path, values, **options):
    """Pairs of int16 in words of 32 bits, then the tag that says so: SampleFormat 5, complex integer."""
    words = np.ascontiguousarray(values).view(np.int32)[..., 0]
    tifffile.imwrite(path, words, photometric="minisblack", metadata=None, **options)
    with tifffile.TiffFile(path, mode="r+b") as file:
        file.pages.first.tags["SampleFormat"].overwrite(5)


def complex_of(values):
    return (values[..., 0] + 1j * values[..., 1]).astype(np.complex64)


@pytest.mark.parametrize("options", [{}, {"rowsperstrip": 1}, {"tile": (16, 16)}, {"compression": "zlib"}, {"bigtiff": True}])
def test_complex_integers_come_back(tmp_path, options):
    values = samples((40, 33))
    write_complex_int16(tmp_path / "x.tiff", values, **options)
    image = read(tmp_path / "x.tiff")
    np.testing.assert_array_equal(image.data, complex_of(values))
    assert image.data.dtype == np.complex64 and image.geometry is None and image.metadata == {"source": "x.tiff"}


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("byteorder", ["<", ">"])
def test_complex_floats_come_back_in_either_byte_order(tmp_path, dtype, byteorder):
    values = complex_of(samples()).astype(dtype)
    tifffile.imwrite(tmp_path / "x.tif", values, byteorder=byteorder)
    image = read(tmp_path / "x.tif")
    np.testing.assert_array_equal(image.data, values)
    assert image.data.dtype == np.complex64 and image.data.dtype.isnative


@pytest.mark.parametrize("mode", ["IW", "EW", "SM"])
@pytest.mark.parametrize("name", ["a-006.tiff", "a_subset_1.tiff"])
def test_annotation_beside_the_file(tmp_path, mode, name):
    write_complex_int16(tmp_path / name, samples())
    (tmp_path / "a-006.xml").write_text(ANNOTATION.format(mode=mode))
    image = read(tmp_path / name)
    assert (image.azimuth_spacing, image.range_spacing) == (13.9, 2.3)
    assert image.metadata["wavelength"] == pytest.approx(299792458.0 / 5.405e9)
    assert image.metadata["acquisition"].startswith("TOPS") == (mode != "SM")
    assert image.geometry is None and image.grid is None


def test_annotation_in_the_folder_of_a_product(tmp_path):
    for folder in ("measurement", "annotation"):
        (tmp_path / folder).mkdir()
    write_complex_int16(tmp_path / "measurement" / "b.tiff", samples())
    (tmp_path / "annotation" / "b.xml").write_text(ANNOTATION.format(mode="IW"))
    assert read(tmp_path / "measurement" / "b.tiff").metadata["swath"] == "IW3"


def test_other_annotations_are_left_alone(tmp_path):
    write_complex_int16(tmp_path / "a_subset.tiff", samples())
    (tmp_path / "b.xml").write_text(ANNOTATION.format(mode="IW"))
    assert read(tmp_path / "a_subset.tiff").azimuth_spacing is None, "another product's"
    (tmp_path / "a-1.xml").write_text("<song/>")
    assert read(tmp_path / "a_subset.tiff").azimuth_spacing is None, "not an annotation"
    for name in ("a-1.xml", "a-2.xml"):
        (tmp_path / name).write_text(ANNOTATION.format(mode="IW"))
    assert read(tmp_path / "a_subset.tiff").azimuth_spacing is None, "one of two: which, nobody says"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (ANNOTATION[:300], "cut short"),
        ("", "cut short"),
        (ANNOTATION.replace("radarFrequency", "other"), "radarFrequency"),
        (ANNOTATION.replace("13.9", "-1"), "azimuth_spacing"),
        (ANNOTATION.replace("13.9", "wide"), "wide"),
    ],
)
def test_bad_annotation(tmp_path, text, says):
    write_complex_int16(tmp_path / "a.tiff", samples())
    (tmp_path / "a.xml").write_text(text.replace("{mode}", "IW"))
    with pytest.raises(FormatError, match=says) as error:
        read(tmp_path / "a.tiff")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("keep", [0, 3, 7, 20, 100, 0.5, 0.9, -1])
@pytest.mark.parametrize("rowsperstrip", [1, 64])
def test_truncated(tmp_path, keep, rowsperstrip, capfd):
    path = tmp_path / "x.tiff"
    write_complex_int16(path, samples((64, 64)), rowsperstrip=rowsperstrip)
    content = path.read_bytes()
    path.write_bytes(content[: keep if isinstance(keep, int) else int(keep * len(content))])
    with pytest.raises(FormatError, match=r"x\.tiff") as error:
        read(path)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == "", "one line is all that is said"


@pytest.mark.parametrize(
    ("tag", "value", "says"),
    [
        ("ImageLength", 2_000_000_000, "cut short"),
        ("ImageWidth", 2_000_000_000, "cut short"),
        ("ImageLength", 65, "cut short|bytes"),
        ("StripOffsets", 4_000_000_000, "cut short"),
        ("StripByteCounts", 4_000_000_000, "cut short"),
        ("StripByteCounts", 8, "cut short"),
        ("SampleFormat", 1, "complex"),
        ("SampleFormat", 77, "complex|SAMPLEFORMAT"),
        ("BitsPerSample", 7, "complex|x.tiff"),
        ("Compression", 5, "x.tiff"),
    ],
)
def test_tags_that_do_not_fit(tmp_path, tag, value, says, capfd):
    path = tmp_path / "x.tiff"
    write_complex_int16(path, samples((64, 64)))
    with tifffile.TiffFile(path, mode="r+b") as file:
        file.pages.first.tags[tag].overwrite(value)
    with pytest.raises(FormatError, match=says) as error:
        read(path)
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("values", "options", "says"),
    [
        (np.zeros((4, 4), np.float32), {}, "float32"),
        (np.zeros((4, 4, 3), np.uint8), {"photometric": "rgb"}, "uint8"),
        (np.zeros((3, 4, 4), np.complex64), {"photometric": "minisblack"}, "one image, got 3"),
        (np.full((4, 4), np.nan, np.complex64), {}, "finite"),
    ],
)
def test_not_one_complex_image(tmp_path, values, options, says):
    tifffile.imwrite(tmp_path / "x.tiff", values, **options)
    with pytest.raises(FormatError, match=says) as error:
        read(tmp_path / "x.tiff")
    assert "\n" not in str(error.value)


def test_missing(tmp_path):
    with pytest.raises(FormatError, match=r"x\.tif: no such file"):
        read(tmp_path / "x.tif")

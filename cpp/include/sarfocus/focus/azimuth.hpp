#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace sarfocus::focus {

struct AzimuthOptions {
    Execution execution;
};

/// Azimuth compression of a strip of range-compressed, migration-corrected data: the azimuth spectrum of every range gate is multiplied by
/// exp(-j pi (f - fdc)^2 / K), K = 2 v^2 / (lambda R) of that gate [Xie2023, eq. 1], fdc the Doppler centroid. f is the one of the aliases
/// of the bin's frequency that lies in [fdc - prf/2, fdc + prf/2). A target is imaged at the time at which its Doppler frequency is
/// fdc (the beam centre), not at zero Doppler. The transform is circular along azimuth and, phase-only, unitary: it keeps the energy, and
/// azimuth_decompress is its inverse and its adjoint.
///
/// raw, image: [n_azimuth, n_range] with one range gate for each geometry.slant_range; any strides. `image` may be the same view as
/// `raw` (in place); other overlap is not allowed. Single-precision transforms: decompress(compress(x)) differs from x by less than 1e-6
/// of its root mean square. Bits do not depend on threads or strides. Beyond its arguments it needs about 1 MiB a thread, or eight
/// range gates where they are longer.
/// Throws ValueError (geometry), ShapeError, NumericalError (NaN or infinity, with its position; `image` is then partly written),
/// Cancelled.
SARFOCUS_API void azimuth_compress(const ImageView& raw, const geometry::StripmapGeometry& geometry, const MutableImageView& image,
                                   const AzimuthOptions& options = {});

/// The inverse: the spectrum times exp(+j pi (f - fdc)^2 / K). As azimuth_compress in everything else.
SARFOCUS_API void azimuth_decompress(const ImageView& image, const geometry::StripmapGeometry& geometry, const MutableImageView& raw,
                                     const AzimuthOptions& options = {});

/// Sees every range gate of an image as it goes by, while it is in cache: called by any thread, once for each gate.
using GateVisitor = std::function<void(std::ptrdiff_t gate, const cfloat* samples)>;

struct AzimuthCorrectOptions {
    GateVisitor before;  ///< optional: [n_azimuth] of the image
    GateVisitor after;   ///< optional: [n_azimuth] of the corrected image
    Execution execution;
};

/// Takes a phase error over slow time off a compressed strip: azimuth_decompress, times exp(-j phase), azimuth_compress, in one pass
/// through memory. The phase of range gate g is interpolated linearly between the rows of `phase`, which belong to the gates `centres`;
/// before the first and behind the last it stays the same.
///
/// phase: [n_block, n_azimuth], rad; centres: [n_block], ascending range gates, fractions allowed. image, corrected: as for
/// azimuth_compress. Throws as that does.
SARFOCUS_API void azimuth_correct(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                  const ArrayView<const double, 2>& phase, const std::vector<double>& centres,
                                  const MutableImageView& corrected, const AzimuthCorrectOptions& options = {});

/// The same for a phase made of shapes over slow time that are scaled from gate to gate: that of gate g is the sum over m of
/// scale(m, g) phase(m, k). phase: [n_shape, n_azimuth], rad; scale: [n_shape, n_range].
SARFOCUS_API void azimuth_correct(const ImageView& image, const geometry::StripmapGeometry& geometry,
                                  const ArrayView<const double, 2>& phase, const ArrayView<const double, 2>& scale,
                                  const MutableImageView& corrected, const AzimuthCorrectOptions& options = {});

}  // namespace sarfocus::focus

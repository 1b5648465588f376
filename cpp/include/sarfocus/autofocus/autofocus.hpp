#pragma once

#include <string>
#include <vector>

#include <sarfocus/autofocus/result.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/execution.hpp>
#include <sarfocus/core/export.hpp>
#include <sarfocus/geometry/stripmap_geometry.hpp>

namespace sarfocus::autofocus {

enum class Scene {
    spotlight,  ///< phase errors over the azimuth spectrum
    strip       ///< phase errors over slow time; needs the geometry
};

/// Names of the methods that `autofocus` can run, in the order in which it trusts them where they do equally well.
[[nodiscard]] SARFOCUS_API std::vector<std::string> method_names(Scene scene);

struct AutofocusOptions {
    std::string method = "auto";       ///< or one of `method_names`, which then decides by itself
    std::vector<std::string> methods;  ///< those that "auto" may choose from; empty: all
    Execution execution;

    /// Throws ValueError, naming the methods there are.
    SARFOCUS_API void validate(Scene scene) const;
};

/// Autofocus of a spotlight image by the method that does best on strong points which had no say in its phase.
///
/// "auto": the range gates are dealt out into two sets of stripes. Every method estimates from one set, without a judgement of its own, and
/// its phase is applied to the other, and the other way round. Scored are the peaks of the points that are strongest over all images, the
/// input among them, so that none is favoured: the mean change in dB, with its standard error. The best whose gain exceeds three of them
/// wins; of those no worse than it within the noise, the first of `method_names`. It then runs on the whole image and judges itself; the
/// entropy of the whole image must fall, and the strong points must not lose on average, no more than a tenth of them 3 dB. Else the next
/// best has its turn. Where one set has next to no strong points, nothing can be held back: the methods run on the whole image in the order
/// of `method_names`, and the first whose result passes the same tests is taken. If none does, the input comes back, bit for bit.
///
/// Of images with more than 512 range gates, the strongest stripes score, together 512 or a quarter of the gates: auto then costs no more
/// than every method once on that part of the image, and the winner on all of it. A method that refuses a part of the image (too small for
/// it, no points) is reported among `Result::trials` with its reason.
///
/// image: [n_azimuth, n_range] complex64. corrected: the same shape, written; may be `image` itself, must not overlap it otherwise. Result:
/// that of the method chosen, with `trials`. Throws ShapeError, ValueError, NumericalError (NaN or infinity, with position; all zero),
/// MemoryEstimateError, Cancelled.
SARFOCUS_API Result autofocus(const ImageView& image, MutableImageView corrected, const AutofocusOptions& options = {});

/// The same for a compressed strip, as azimuth_compress or form_stripmap makes it. Throws as spga_linear, too.
SARFOCUS_API Result autofocus(const ImageView& image, const geometry::StripmapGeometry& geometry, MutableImageView corrected,
                              const AutofocusOptions& options = {});

}  // namespace sarfocus::autofocus

#include <sarfocus/hrws/reconstruct.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

#include "channel_centres.hpp"
#include "sub_image.hpp"

namespace sarfocus::hrws {
namespace {

// Between frequencies weights are lines: finer steps than they need themselves, so that entries next to each other are all but equal and
// one serves many pixels.
focus::AspectWeights aspect_weights(const Echo& echo, const Sampling& sampled, const ChannelWeights& weights, std::ptrdiff_t channel) {
    const double sine_of_hertz = echo.wavelength / (2.0 * echo.velocity);
    const std::ptrdiff_t n = weights.weights.extent(0);
    focus::AspectWeights out;
    out.axis = sampled.direction;
    out.sine_start = sine_of_hertz * weights.frequency_start;
    out.sine_stop = sine_of_hertz * (weights.frequency_start + weights.frequency_step * static_cast<double>(n));
    constexpr std::ptrdiff_t parts = 16;  // of a step
    out.table.reserve(static_cast<std::size_t>(n * parts));
    for (std::ptrdiff_t i = 0; i < n; ++i)
        for (std::ptrdiff_t part = 0; part < parts; ++part) {
            const double place = (static_cast<double>(part) + 0.5) / static_cast<double>(parts) - 0.5;  // from the middle of the step
            const std::ptrdiff_t other = std::clamp<std::ptrdiff_t>(place < 0.0 ? i - 1 : i + 1, 0, n - 1);
            const double share = std::abs(place);
            out.table.emplace_back((1.0 - share) * weights.weights(i, channel) + share * weights.weights(other, channel));
        }
    return out;
}

void reconstruct_folded(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion, MutableImageView image,
                        const ReconstructOptions& options) {
    const Sampling sampled = sampling(echo);
    const ChannelWeights weights = channel_weights(sampled.offsets, echo.prf, echo.velocity, options.band);
    for (std::ptrdiff_t i = 0; i < image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) image(i, j) = {};
    for (std::ptrdiff_t n = 0; n < echo.n_channel(); ++n) {
        const detail::ChannelCentres centres(echo, motion, n);
        focus::BackprojectOptions part;
        part.execution = detail::part_of(options.execution, n, echo.n_channel());
        focus::backproject_weighted(echo.profiles(n), centres.view(), grid, aspect_weights(echo, sampled, weights, n), image, part);
    }
}

}  // namespace

void require_reconstructible(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion,
                             MutableImageView image, const ReconstructOptions& options) {
    echo.validate(options.execution.threads);
    options.band.validate(echo.n_channel(), echo.prf);
    if (!motion.empty()) {
        const std::array<std::ptrdiff_t, 2> wanted{echo.n_pulse(), 3};
        if (motion.extents() != wanted) throw ShapeError("motion", shape_text(wanted), shape_text(motion.extents()));
        require_finite(motion, "motion");
    }
    if (image.extents() != grid.shape())
        throw ShapeError("image", "the shape of the grid " + shape_text(grid.shape()), shape_text(image.extents()));
    const double highest = std::abs(options.band.doppler_centroid) + 0.5 * options.band.processed(echo.n_channel(), echo.prf);
    if (highest > 2.0 * echo.velocity / echo.wavelength)
        throw ValueError("doppler_bandwidth",
                         "frequencies up to 2 velocity / wavelength = " + number_text(2.0 * echo.velocity / echo.wavelength),
                         number_text(highest));
}

void reconstruct(const Echo& echo, const geometry::ImageGrid& grid, const ArrayView<const double, 2>& motion, MutableImageView image,
                 const ReconstructOptions& options) {
    require_reconstructible(echo, grid, motion, image, options);
    if (options.reconstruction == Reconstruction::folded)
        reconstruct_folded(echo, grid, motion, image, options);
    else
        detail::reconstruct_sub_images(echo, grid, motion, image, options);
}

Execution detail::part_of(const Execution& whole, std::int64_t part, std::int64_t parts) {
    Execution out;
    out.threads = whole.threads;
    if (whole.progress)
        out.progress = [&whole, part, parts](const ProgressUpdate& update) {
            return whole.progress({update.phase, update.done + part * update.total, parts * update.total});
        };
    return out;
}

}  // namespace sarfocus::hrws

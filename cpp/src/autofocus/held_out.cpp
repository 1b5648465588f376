#include "held_out.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <utility>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/detect/local_maxima.hpp>
#include <sarfocus/quality/image_measures.hpp>
#include <sarfocus/signal/interpolation.hpp>

#include "gate_stripes.hpp"
#include "strip_lines.hpp"
#include "strip_window.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::size_t most_places = 100;  // the mean of more is known well enough
constexpr double range_cells_apart = 3.0;
constexpr double side_lobe = 0.25;      // 6 dB: what is weaker, in the reach of a stronger point of its gates, may be its defocused energy
constexpr double dynamic_range = 1e-4;  // weaker than the strongest by 40 dB: side lobes in range

std::ptrdiff_t circular_distance(std::ptrdiff_t a, std::ptrdiff_t b, std::ptrdiff_t n) {
    const std::ptrdiff_t d = std::abs(a - b);
    return std::min(d, n - d);
}

// Mean power of speckle between the points, from the median of at most 65536 pixels.
double speckle_power(const Array<float, 2>& power) {
    constexpr std::ptrdiff_t at_most = 65536;
    const std::ptrdiff_t step = std::max<std::ptrdiff_t>(power.size() / at_most, 1);
    std::vector<float> some;
    for (std::ptrdiff_t k = 0; k < power.size(); k += step) some.push_back(power.data()[k]);
    const auto middle = some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2);
    std::nth_element(some.begin(), middle, some.end());
    return static_cast<double>(*middle) / std::log(2.0);
}

double interpolated_peak_db(const Array<cfloat, 1>& fine, std::ptrdiff_t centre, std::ptrdiff_t half) {
    const std::ptrdiff_t n = fine.extent(0);
    const auto power = [&](std::ptrdiff_t k) { return std::norm(cdouble(fine(((k % n) + n) % n))); };
    std::ptrdiff_t best = centre - half;
    for (std::ptrdiff_t k = centre - half; k <= centre + half; ++k)
        if (power(k) > power(best)) best = k;
    const double middle = std::log(power(best));
    const double left = std::log(power(best - 1));
    const double right = std::log(power(best + 1));
    const double curvature = left - 2.0 * middle + right;
    const double top = curvature < 0.0 && std::isfinite(curvature) ? middle - 0.125 * (left - right) * (left - right) / curvature : middle;
    return 10.0 / std::log(10.0) * top;
}

double entropy_about(const ArrayView<const cfloat, 1>& line, std::ptrdiff_t centre, std::ptrdiff_t half) {
    const std::ptrdiff_t n = line.extent(0);
    std::vector<cfloat> samples;
    for (std::ptrdiff_t k = centre - half; k <= centre + half; ++k) samples.push_back(line(((k % n) + n) % n));
    return quality::entropy_sums(samples.data(), static_cast<std::ptrdiff_t>(samples.size())).entropy();
}

}  // namespace

PlaceRule place_rule(const Subject& subject, const CellSize& cell) {
    const std::ptrdiff_t n = subject.image.extent(0);
    PlaceRule out;
    out.range_cell = cell.range;
    if (subject.geometry != nullptr) {
        out.search = narrow_window(*subject.geometry);
        out.reach = std::lround(0.5 * subject.geometry->aperture_samples(subject.geometry->slant_range.size() / 2));
    } else {
        out.search = std::max<std::ptrdiff_t>(std::lround(8.0 * cell.azimuth), n / 16);
        out.reach = n;
    }
    out.search = std::min(out.search, (n - 1) / 2);
    return out;
}

Brightest::Brightest(const ImageView& first, const Execution& execution) : power_(first.extents()) {
    add(first, execution);
    background_ = speckle_power(power_);
}

void Brightest::add(const ImageView& image, const Execution& execution) {
    ++images_;
    parallel_for(execution, "strong points", image.extent(0), [&](std::int64_t i) {
        for (std::ptrdiff_t j = 0; j < image.extent(1); ++j) power_(i, j) = std::max(power_(i, j), std::norm(image(i, j)));
    });
}

std::vector<JudgedPoint> Brightest::places(const std::vector<std::ptrdiff_t>& gates, const std::vector<bool>& inner, const PlaceRule& rule,
                                           const Execution& execution) const {
    const std::ptrdiff_t n = power_.extent(0);
    Array<bool, 1> counts({power_.extent(1)});
    std::copy(inner.begin(), inner.end(), counts.begin());
    const ArrayView<const bool, 2> mask(counts.data(), power_.extents(), {0, 1});  // alike for all azimuth lines
    detect::LocalMaximaOptions options;
    options.half_width = {1, 0};
    // The brightest speckle of so many pixels and images; one scene of 150 has one brighter by chance.
    constexpr double chance = 5.0;
    const auto looks = static_cast<double>(power_.size()) * images_;
    options.minimum = background_ * (std::log(looks) + chance);
    options.execution = execution;
    const std::vector<detect::Point> maxima = detect::local_maxima(power_.view(), options, mask);
    std::vector<JudgedPoint> out;
    for (const detect::Point& p : maxima) {
        if (out.size() == most_places || (!out.empty() && p.intensity < dynamic_range * out.front().power)) break;
        const bool alone = std::none_of(out.begin(), out.end(), [&](const JudgedPoint& q) {
            const auto gates_apart = static_cast<double>(std::abs(gates[at(q.column)] - gates[at(p.range)]));
            if (gates_apart > range_cells_apart * rule.range_cell) return false;
            const std::ptrdiff_t apart = circular_distance(p.azimuth, q.azimuth, n);
            return apart <= 2 * rule.search || (apart <= rule.reach && p.intensity < side_lobe * q.power);
        });
        if (alone) out.push_back({p.azimuth, p.range, p.intensity});
    }
    return out;
}

double band_centre(const Subject& subject) {
    if (subject.geometry != nullptr) return subject.geometry->doppler_centroid / subject.geometry->prf;
    cdouble correlation{};
    double power = 0.0;
    for (std::ptrdiff_t i = 0; i + 1 < subject.image.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < subject.image.extent(1); ++j) {
            correlation += cdouble(subject.image(i + 1, j)) * std::conj(cdouble(subject.image(i, j)));
            power += std::norm(cdouble(subject.image(i, j)));
        }
    constexpr double full_band = 0.05;  // a band over the whole sampling rate has no middle of its own
    return std::abs(correlation) > full_band * power ? std::arg(correlation) / two_pi : 0.0;
}

PlaceMeasures measure(const ImageView& image, double centre, const std::vector<JudgedPoint>& places, const PlaceRule& rule,
                      const Execution& execution) {
    constexpr std::ptrdiff_t factor = 4;  // a parabola through the logarithm is good to 0.01 dB then
    const std::ptrdiff_t n = image.extent(0);
    const signal::LineUpsampler<float> upsampler(n, factor, centre);
    PlaceMeasures out;
    out.peak_db.resize(places.size());
    out.entropy.resize(places.size());
    parallel_for(execution, "measure points", static_cast<std::int64_t>(places.size()), [&](std::int64_t p) {
        const JudgedPoint& place = places[at(p)];
        Array<cfloat, 1> fine({n * factor});
        upsampler.apply(image.column(place.column), fine.view());
        out.peak_db[at(p)] = interpolated_peak_db(fine, place.azimuth * factor, rule.search * factor);
        out.entropy[at(p)] = entropy_about(image.column(place.column), place.azimuth, rule.search);
    });
    return out;
}

PlaceMeasures measure_without(const Subject& subject, const std::vector<double>& phase, double centre,
                              const std::vector<JudgedPoint>& places, const PlaceRule& rule, const Execution& execution) {
    if (places.empty()) return {};
    std::vector<std::ptrdiff_t> columns;
    for (const JudgedPoint& p : places) columns.push_back(p.column);
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    const Part part(subject, columns, execution);
    std::vector<JudgedPoint> moved = places;
    for (JudgedPoint& p : moved) p.column = std::lower_bound(columns.begin(), columns.end(), p.column) - columns.begin();
    Array<cfloat, 2> corrected(part.subject().image.extents());
    take_out(part.subject(), phase, corrected.view(), execution);
    return measure(corrected.view(), centre, moved, rule, execution);
}

std::string objection_of_points(const Subject& subject, const ImageView& corrected, const PlaceRule& rule, double centre,
                                const Execution& execution) {
    Brightest brightest(subject.image, execution);
    brightest.add(corrected, execution);
    std::vector<std::ptrdiff_t> gates(at(corrected.extent(1)));
    std::iota(gates.begin(), gates.end(), std::ptrdiff_t{0});
    const std::vector<JudgedPoint> places = brightest.places(gates, std::vector<bool>(gates.size(), true), rule, execution);
    const PlaceMeasures before = measure(subject.image, centre, places, rule, execution);
    const PlaceMeasures after = measure(corrected, centre, places, rule, execution);
    double mean = 0.0;
    int losers = 0;
    constexpr double much = 3.0;  // dB, as spga_linear asks of its points
    for (std::size_t p = 0; p < places.size(); ++p) {
        const double gain = after.peak_db[p] - before.peak_db[p];
        mean += gain / static_cast<double>(places.size());
        if (gain < -much) ++losers;
    }
    char text[120];
    if (mean < 0.0)
        std::snprintf(text, sizeof text, "the %zu strong points of the whole image lose %.2f dB on average", places.size(), -mean);
    else if (static_cast<double>(losers) > 0.1 * static_cast<double>(places.size()))
        std::snprintf(text, sizeof text, "%d of the %zu strong points of the whole image lose 3 dB or more", losers, places.size());
    else
        return {};
    return text;
}

MeanGain mean_gain(const std::vector<double>& gains_db) {
    MeanGain out{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
    if (gains_db.empty()) return out;
    const auto n = static_cast<double>(gains_db.size());
    out.mean = 0.0;
    for (const double g : gains_db) out.mean += g / n;
    constexpr double prior = 0.5;  // dB
    double square = prior * prior;
    for (const double g : gains_db) square += (g - out.mean) * (g - out.mean);
    out.standard_error = std::sqrt(square) / n;
    return out;
}

}  // namespace sarfocus::autofocus::detail

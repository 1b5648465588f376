#include "focus/migration_correction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>

#include "focus/apply_phase.hpp"
#include "focus/line_workspace.hpp"

namespace sarfocus::focus {
namespace {

using geometry::StripmapGeometry;

constexpr std::ptrdiff_t guard_samples = 32;
constexpr std::ptrdiff_t most_references = 128;
constexpr double negligible = 1e-3;   // rad
constexpr double largest_step = 0.1;  // rad between references; linear between them leaves step^2 / 8

double cosine_of(double sine) {
    return std::sqrt(1.0 - sine * sine);
}

// The exact two-dimensional spectrum of a point at closest range R has the phase -4 pi R / wavelength * sqrt((1 + x)^2 - sine^2), x the
// range frequency over that of the carrier, sine = wavelength f / (2 v). The root less its value and tangent at x = 0: what secondary range
// compression takes out.
double excess_path(double x, double sine, double cosine) {
    return std::sqrt((1.0 + x) * (1.0 + x) - sine * sine) - cosine - x / cosine;
}

}  // namespace

MigrationCorrection::MigrationCorrection(const StripmapGeometry& geometry, const FastTime& fast_time, std::ptrdiff_t n_pulse,
                                         std::ptrdiff_t n_fast_time)
    : geometry_(geometry),
      range_start_(fast_time.range_start),
      spacing_(speed_of_light / (2.0 * fast_time.range_sampling)),
      range_band_(fast_time.range_sampling * geometry.wavelength / speed_of_light),
      sine_of_hertz_(geometry.wavelength / (2.0 * geometry.velocity)),
      n_pulse_(n_pulse),
      n_fast_time_(n_fast_time),
      n_(checked_length()),
      forward_(n_, fft::Direction::forward),
      inverse_(2 * n_, fft::Direction::inverse) {}

MigrationCorrection::Workspace::Workspace(const MigrationCorrection& correction)
    : excess_(static_cast<std::size_t>(correction.n_)),
      spectrum_({correction.n_}),
      fine_({2 * correction.n_ + 2 * margin}),
      values_({static_cast<std::ptrdiff_t>(correction.geometry_.slant_range.size())}),
      gates_(values_.extents()) {}

std::uint64_t MigrationCorrection::workspace_bytes() const {
    const auto n = static_cast<std::uint64_t>(n_);
    return n * sizeof(double) + sizeof(cfloat) * (3 * n + 2 * margin + 2 * geometry_.slant_range.size());
}

// f - fdc of the alias within half the prf of fdc, Hz.
double MigrationCorrection::doppler_offset(std::ptrdiff_t bin) const {
    const double cycles = static_cast<double>(bin) / static_cast<double>(n_pulse_) - geometry_.doppler_centroid / geometry_.prf;
    return geometry_.prf * (cycles - std::floor(cycles + 0.5));
}

void MigrationCorrection::require_band() const {
    if (geometry_.doppler_bandwidth * static_cast<double>(n_pulse_) < geometry_.prf)
        throw ValueError("doppler_bandwidth",
                         "at least prf / n_pulse = " + number_text(geometry_.prf / static_cast<double>(n_pulse_)) + " Hz",
                         number_text(geometry_.doppler_bandwidth));
    const double reach = std::abs(geometry_.doppler_centroid) + 0.5 * geometry_.doppler_bandwidth;
    const double limit = (1.0 - 0.5 * range_band_) / sine_of_hertz_;
    if (!(limit > 0.0))
        throw ValueError("range_sampling", "less than twice the carrier frequency of " + number_text(speed_of_light / geometry_.wavelength),
                         number_text(speed_of_light / (2.0 * spacing_)));
    if (!(reach < limit))
        throw ValueError("doppler_centroid",
                         "|doppler_centroid| + doppler_bandwidth / 2 below 2 velocity / wavelength, less half the range band, " +
                             number_text(limit) + " Hz",
                         number_text(reach) + " Hz");
    const double sine = reach * sine_of_hertz_;
    if (!(variation(sine) <= largest_step * (most_references - 1)))
        throw ValueError("slant_range",
                         "a swath over which secondary range compression at the edges of the Doppler and range bands varies by at most " +
                             number_text(largest_step * (most_references - 1)) + " rad",
                         number_text(geometry_.slant_range.back() - geometry_.slant_range.front()) + " m");
}

// Every gate must be recorded at one Doppler frequency of the band at least.
void MigrationCorrection::require_recorded() const {
    const double centroid = std::abs(geometry_.doppler_centroid);
    const double half = 0.5 * geometry_.doppler_bandwidth;
    const double nearest = range_start_ - 0.5 * spacing_;
    const double farthest = range_start_ + (static_cast<double>(n_fast_time_) - 0.5) * spacing_;
    const double low = nearest * cosine_of((centroid + half) * sine_of_hertz_);
    const double high = farthest * cosine_of(std::max(0.0, centroid - half) * sine_of_hertz_);
    for (std::size_t j = 0; j < geometry_.slant_range.size(); ++j)
        if (!(geometry_.slant_range[j] >= low && geometry_.slant_range[j] <= high))
            throw ValueError(
                "slant_range[" + std::to_string(j) + "]",
                "a range that was recorded at some Doppler frequency of the band, " + number_text(low) + " to " + number_text(high) + " m",
                number_text(geometry_.slant_range[j]));
}

// With zeros behind the record: what the kernel and secondary range compression spread must not come in at the other end.
std::ptrdiff_t MigrationCorrection::checked_length() const {
    require_band();
    require_recorded();
    const double sine = (std::abs(geometry_.doppler_centroid) + 0.5 * geometry_.doppler_bandwidth) * sine_of_hertz_;
    const double x = 1.0 - 0.5 * range_band_;
    const double slope = x / std::sqrt(x * x - sine * sine) - 1.0 / cosine_of(sine);
    const double spread = std::abs(slope) * geometry_.slant_range.back() / spacing_;
    const double room = std::min(std::ceil(spread), static_cast<double>(n_fast_time_));
    return fft::good_size(n_fast_time_ + guard_samples + static_cast<std::ptrdiff_t>(room));
}

// Phase of secondary range compression at the edges of the range band, how much it varies over the swath, rad.
double MigrationCorrection::variation(double sine) const {
    const double cosine = cosine_of(sine);
    const double excess =
        std::max(std::abs(excess_path(-0.5 * range_band_, sine, cosine)), std::abs(excess_path(0.5 * range_band_, sine, cosine)));
    return 2.0 * two_pi / geometry_.wavelength * (geometry_.slant_range.back() - geometry_.slant_range.front()) * excess;
}

// gates[j] += weight * (the line of workspace.spectrum_, without the excess path of `reference`, at the migrated range of gate j); the
// weight falls linearly from 1 at the reference to 0 at `reach` from it.
void MigrationCorrection::add_reference(double cosine, double reference, double reach, Workspace& workspace) const {
    const double rate = 2.0 * reference / geometry_.wavelength;
    const float scale = 1.0f / static_cast<float>(n_);
    const std::ptrdiff_t positive = (n_ + 1) / 2;
    const std::ptrdiff_t negative = n_ - positive;
    cfloat* fine = workspace.fine_.data() + margin;
    cfloat* high = fine + 2 * n_ - negative;
    std::copy_n(workspace.spectrum_.data(), positive, fine);
    std::fill(fine + positive, high, cfloat());
    std::copy_n(workspace.spectrum_.data() + positive, negative, high);
    apply_phase(fine, workspace.excess_.data(), positive, rate, scale);
    apply_phase(high, workspace.excess_.data() + positive, negative, rate, scale);
    // The bin on both edges of the band is shared between them.
    if (n_ % 2 == 0) fine[positive] = *high *= 0.5f;
    inverse_.execute(fine);
    std::copy_n(fine + 2 * n_ - margin, margin, fine - margin);
    std::copy_n(fine, margin, fine + 2 * n_);

    const auto& ranges = geometry_.slant_range;
    const double last_place = static_cast<double>(n_fast_time_) - 0.5;
    const double low = std::max(reference - reach, cosine * (range_start_ - 0.5 * spacing_));
    const double high_end = std::min(reference + reach, cosine * (range_start_ + last_place * spacing_));
    const std::ptrdiff_t begin = std::lower_bound(ranges.begin(), ranges.end(), low) - ranges.begin();
    const std::ptrdiff_t end = std::upper_bound(ranges.begin() + begin, ranges.end(), high_end) - ranges.begin();
    cfloat* values = workspace.values_.data();
    kernel_.interpolate(fine, -2.0 * range_start_ / spacing_, 2.0 / (cosine * spacing_), ranges.data() + begin, end - begin, values);
    for (std::ptrdiff_t j = begin; j < end; ++j) {
        const double distance = std::abs(ranges[static_cast<std::size_t>(j)] - reference);
        workspace.gates_.data()[j] += static_cast<float>(1.0 - std::min(1.0, distance / reach)) * values[j - begin];
    }
}

bool MigrationCorrection::apply(std::ptrdiff_t bin, const ArrayView<const cfloat, 1>& line, const ArrayView<cfloat, 1>& gates,
                                Workspace& workspace) const {
    const std::ptrdiff_t n_range = gates.extent(0);
    const double offset = doppler_offset(bin);
    const double half = 0.5 * geometry_.doppler_bandwidth;
    if (!(offset >= -half && offset < half)) {
        for (std::ptrdiff_t j = 0; j < n_range; ++j) gates(j) = cfloat();
        return true;
    }
    const double sine = (geometry_.doppler_centroid + offset) * sine_of_hertz_;
    const double cosine = cosine_of(sine);
    cfloat* spectrum = workspace.spectrum_.data();
    for (std::ptrdiff_t i = 0; i < n_fast_time_; ++i) spectrum[i] = line(i);
    std::fill(spectrum + n_fast_time_, spectrum + n_, cfloat());
    forward_.execute(spectrum);
    if (!is_finite(spectrum[0])) return false;
    for (std::ptrdiff_t k = 0; k < n_; ++k) {
        const std::ptrdiff_t signed_k = k < (n_ + 1) / 2 ? k : k - n_;
        const double x = range_band_ * static_cast<double>(signed_k) / static_cast<double>(n_);
        workspace.excess_[static_cast<std::size_t>(k)] = excess_path(x, sine, cosine);
    }

    const auto& ranges = geometry_.slant_range;
    std::fill(workspace.gates_.begin(), workspace.gates_.end(), cfloat());
    const double turn = variation(sine);
    if (turn <= 2.0 * negligible) {
        add_reference(cosine, 0.5 * (ranges.front() + ranges.back()), std::numeric_limits<double>::infinity(), workspace);
    } else {
        const auto intervals = static_cast<std::ptrdiff_t>(std::ceil(turn / largest_step));
        const double step = (ranges.back() - ranges.front()) / static_cast<double>(intervals);
        for (std::ptrdiff_t m = 0; m <= intervals; ++m)
            add_reference(cosine, ranges.front() + step * static_cast<double>(m), step, workspace);
    }

    // Azimuth filter: hyperbolic phase from zero Doppler, and the way from zero Doppler to the beam centre.
    const double centre = geometry_.doppler_centroid * sine_of_hertz_;
    const double path = cosine - 1.0 + sine * centre / cosine_of(centre);
    apply_phase(workspace.gates_.data(), ranges.data(), n_range, 2.0 * path / geometry_.wavelength, 1.0f / static_cast<float>(n_pulse_));
    for (std::ptrdiff_t j = 0; j < n_range; ++j) gates(j) = workspace.gates_.data()[j];
    return true;
}

}  // namespace sarfocus::focus

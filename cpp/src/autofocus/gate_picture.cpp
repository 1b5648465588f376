#include "gate_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <omp.h>

#include <sarfocus/core/complex_product.hpp>
#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/multiversion.hpp>
#include <sarfocus/detect/local_maxima.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::size_t maxima_of_a_piece = 4;
constexpr std::ptrdiff_t gates_for_points = 128;  // strongest gates where some of the strongest points are all that is asked for
constexpr std::ptrdiff_t background_samples = 64;
constexpr std::ptrdiff_t lanes = 16;

struct Maximum {
    float power = 0.0F;  // 0: none
    float left = 0.0F;   // of the neighbours; 0 beyond the ends
    float right = 0.0F;
    std::int32_t azimuth = 0;

    // Of the peak between the samples.
    [[nodiscard]] double place() const { return static_cast<double>(azimuth) + sub_pixel(left, power, right); }
};
using Piece = std::array<Maximum, maxima_of_a_piece>;  // the strongest first

struct PowerSums {
    double power = 0.0;
    double square = 0.0;
};

SARFOCUS_MULTIVERSION void turn(const cfloat* spectrum, const cfloat* factor, std::ptrdiff_t n, cfloat* line) {
    for (std::ptrdiff_t k = 0; k < n; ++k) line[k] = product(spectrum[k], factor[k]);
}

SARFOCUS_MULTIVERSION PowerSums intensities(const cfloat* line, std::ptrdiff_t n, float* intensity) {
    const auto* x = reinterpret_cast<const float*>(line);
    double power[lanes] = {};
    double square[lanes] = {};
    const std::ptrdiff_t whole = n / lanes * lanes;
    for (std::ptrdiff_t i = 0; i < whole; i += lanes)
        for (std::ptrdiff_t l = 0; l < lanes; ++l) {
            const float value = x[2 * (i + l)] * x[2 * (i + l)] + x[2 * (i + l) + 1] * x[2 * (i + l) + 1];
            intensity[i + l] = value;
            power[l] += static_cast<double>(value);
            square[l] += static_cast<double>(value) * static_cast<double>(value);
        }
    PowerSums out;
    for (std::ptrdiff_t l = 0; l < lanes; ++l) {
        out.power += power[l];
        out.square += square[l];
    }
    for (std::ptrdiff_t i = whole; i < n; ++i) {
        intensity[i] = x[2 * i] * x[2 * i] + x[2 * i + 1] * x[2 * i + 1];
        out.power += static_cast<double>(intensity[i]);
        out.square += static_cast<double>(intensity[i]) * static_cast<double>(intensity[i]);
    }
    return out;
}

inline __attribute__((always_inline)) bool any_above(const float* values, float least) {
    int above = 0;
    for (std::ptrdiff_t l = 0; l < lanes; ++l) above |= static_cast<int>(values[l] > least);
    return above != 0;
}

// At least as strong as its right neighbour and stronger than its left one.
inline __attribute__((always_inline)) bool is_maximum(const float* intensity, std::ptrdiff_t i, std::ptrdiff_t n) {
    return (i == 0 || intensity[i] > intensity[i - 1]) && (i + 1 == n || intensity[i] >= intensity[i + 1]);
}

// Into `strongest`, whose last falls out.
void put_in(Piece& strongest, const Maximum& one) {
    std::size_t place = strongest.size() - 1;
    for (; place > 0 && one.power > strongest[place - 1].power; --place) strongest[place] = strongest[place - 1];
    strongest[place] = one;
}

SARFOCUS_MULTIVERSION void find_maxima(const float* intensity, std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t n, Piece& out) {
    float least = 0.0F;
    for (std::ptrdiff_t first = begin; first < end; first += lanes) {
        const std::ptrdiff_t last = std::min(first + lanes, end);
        if (last - first == lanes && !any_above(intensity + first, least)) continue;
        for (std::ptrdiff_t i = first; i < last; ++i) {
            if (!(intensity[i] > least) || !is_maximum(intensity, i, n)) continue;
            put_in(out, {intensity[i], i > 0 ? intensity[i - 1] : 0.0F, i + 1 < n ? intensity[i + 1] : 0.0F, static_cast<std::int32_t>(i)});
            least = out.back().power;
        }
    }
}

// A maximum, by range gate, and where it is from.
struct Candidate {
    detect::Point point;
    const Maximum* maximum;
    std::ptrdiff_t column;
};

Candidate candidate(const PixelLayout& layout, std::ptrdiff_t column, const Maximum& maximum) {
    return {{maximum.azimuth, layout.range_gate(column), static_cast<double>(maximum.power)}, &maximum, column};
}

// Coalescence of candidates, the strongest first.
std::vector<Pixel> coalesced(const std::vector<Candidate>& candidates, const CellSize& separation) {
    std::vector<detect::Point> points;
    for (const Candidate& c : candidates) points.push_back(c.point);
    std::vector<std::size_t> order(candidates.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto place = [](const detect::Point& p) { return std::pair(p.range, p.azimuth); };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return place(points[a]) < place(points[b]); });
    std::vector<Pixel> out;
    for (const detect::Point& p : detect::coalesce(points, reach_of(separation))) {
        const auto found = std::lower_bound(order.begin(), order.end(), p,
                                            [&](std::size_t a, const detect::Point& b) { return place(points[a]) < place(b); });
        out.push_back({candidates[*found].maximum->place(), static_cast<double>(candidates[*found].column)});
    }
    return out;
}

}  // namespace

struct GatePicture::Gate {
    HalfSums sums;
    quality::EntropySums entropy;
    std::vector<Piece> pieces;
    std::vector<float> samples;  // some of its intensities
};

class GatePicture::Workspace {
public:
    explicit Workspace(std::ptrdiff_t n) : line({n}), intensity(at(n)) {}

    Array<cfloat, 1> line;
    std::vector<float> intensity;
};

GatePicture::GatePicture(const SpectrumSource& source, std::ptrdiff_t piece, const Execution& execution)
    : source_(source),
      n_azimuth_(source.shape()[0]),
      piece_(piece),
      execution_(execution),
      inverse_(n_azimuth_, fft::Direction::inverse),
      untouched_(at(source.shape()[1])),
      turned_(at(source.shape()[1])) {
    columns_ = columns_for({});
    const std::vector<double> no_phase(at(source.n_pulse()), 0.0);
    form(no_phase, Purpose::everything, untouched_);
    gates_ = &untouched_;
    strongest_ = columns_;
    std::stable_sort(strongest_.begin(), strongest_.end(),
                     [&](std::ptrdiff_t a, std::ptrdiff_t b) { return untouched_[at(a)].sums.square > untouched_[at(b)].sums.square; });
}

GatePicture::~GatePicture() = default;

bool GatePicture::of(std::ptrdiff_t column, Portion part) const {
    return part == Portion::everywhere || halves_->of(0, column) == static_cast<int>(part);
}

std::vector<std::ptrdiff_t> GatePicture::columns_for(const Look& look) const {
    std::vector<std::ptrdiff_t> out;
    if (look.purpose == Purpose::some_points) {
        for (const std::ptrdiff_t c : strongest_)
            if (of(c, look.part) && static_cast<std::ptrdiff_t>(out.size()) < gates_for_points) out.push_back(c);
        std::sort(out.begin(), out.end());
        return out;
    }
    for (std::ptrdiff_t c = 0; c < source_.shape()[1]; ++c)
        if (of(c, look.part)) out.push_back(c);
    return out;
}

void GatePicture::look_at(std::ptrdiff_t column, const std::vector<cfloat>& factor, Purpose purpose, Workspace& workspace,
                          Gate& gate) const {
    cfloat* line = workspace.line.data();
    turn(source_.spectrum().data() + column * n_azimuth_, factor.data(), n_azimuth_, line);
    inverse_.execute(line);
    const PowerSums sums = intensities(line, n_azimuth_, workspace.intensity.data());
    gate.sums = {static_cast<double>(n_azimuth_), sums.power, sums.square};
    if (purpose == Purpose::entropy || purpose == Purpose::everything) gate.entropy = quality::entropy_sums(line, n_azimuth_);
    if (purpose == Purpose::entropy || purpose == Purpose::sums) return;
    gate.pieces.assign(at((n_azimuth_ + piece_ - 1) / piece_), Piece{});
    for (std::ptrdiff_t begin = 0; begin < n_azimuth_; begin += piece_)
        find_maxima(workspace.intensity.data(), begin, std::min(begin + piece_, n_azimuth_), n_azimuth_, gate.pieces[at(begin / piece_)]);
    gate.samples.clear();
    for (std::ptrdiff_t i = column % 8; i < n_azimuth_; i += std::max<std::ptrdiff_t>(n_azimuth_ / background_samples, 1))
        gate.samples.push_back(workspace.intensity[at(i)]);
}

void GatePicture::form(const std::vector<double>& phase, Purpose purpose, std::vector<Gate>& gates) {
    const std::vector<cfloat> factor = source_.factors(phase);
    std::vector<std::unique_ptr<Workspace>> workspaces(at(resolve_threads(execution_.threads)));
    parallel_for(execution_, "form", static_cast<std::int64_t>(columns_.size()), [&](std::int64_t c) {
        auto& workspace = workspaces[at(omp_get_thread_num())];
        if (!workspace) workspace = std::make_unique<Workspace>(n_azimuth_);
        look_at(columns_[at(c)], factor, purpose, *workspace, gates[at(columns_[at(c)])]);
    });
}

void GatePicture::focus(const std::vector<double>& phase, const Look& look) {
    columns_ = columns_for(look);
    const bool untouched = std::all_of(phase.begin(), phase.end(), [](double p) { return p == 0.0; });
    gates_ = untouched ? &untouched_ : &turned_;
    if (!untouched) form(phase, look.purpose, turned_);
}

CellSize GatePicture::cell_size() const {
    const Array<cfloat, 2>& spectrum = source_.spectrum();
    struct Sums {
        double power = 0.0;
        cdouble along_azimuth;
        cdouble along_range;
    };
    std::vector<Sums> sums(at(spectrum.extent(0)));
    const auto neighbours = [&](std::ptrdiff_t c) {
        return c + 1 < spectrum.extent(0) && source_.range_gate(c + 1) - source_.range_gate(c) == 1;
    };
    parallel_for(execution_, "cell size", spectrum.extent(0), [&](std::int64_t c) {
        const cfloat* line = spectrum.data() + c * n_azimuth_;
        Ramp ramp(-two_pi / static_cast<double>(n_azimuth_), 0.0);
        const bool next = neighbours(c);
        Sums out;
        for (std::ptrdiff_t k = 0; k < n_azimuth_; ++k) {
            const double power = std::norm(cdouble(line[k]));
            out.power += power;
            out.along_azimuth += power * ramp.next();
            if (next) out.along_range += times_conjugate(cdouble(line[k]), cdouble(line[n_azimuth_ + k]));
        }
        sums[at(c)] = out;
    });
    Sums all;
    double range_power = 0.0;
    for (std::ptrdiff_t c = 0; c < spectrum.extent(0); ++c) {
        all.power += sums[at(c)].power;
        all.along_azimuth += sums[at(c)].along_azimuth;
        all.along_range += sums[at(c)].along_range;
        if (neighbours(c)) range_power += sums[at(c)].power;
    }
    CellSize out;
    if (all.power > 0.0) out.azimuth = pixels_per_cell(std::abs(all.along_azimuth) / all.power);
    if (range_power > 0.0) out.range = pixels_per_cell(std::abs(all.along_range) / range_power);
    return out;
}

std::vector<Pixel> GatePicture::strongest(int count, const CellSize& separation, Portion part) const {
    std::vector<Candidate> all;
    all.reserve(columns_.size() * maxima_of_a_piece * at((n_azimuth_ + piece_ - 1) / piece_));
    for (const std::ptrdiff_t c : columns_) {
        if (!of(c, part)) continue;
        for (const Piece& piece : (*gates_)[at(c)].pieces)
            for (const Maximum& m : piece)
                if (m.power > 0.0F) all.push_back(candidate(source_, c, m));
    }
    // A few times as many as are wanted leave enough, as a rule.
    constexpr std::size_t times_wanted = 4;
    std::vector<Pixel> out;
    for (std::size_t most = times_wanted * static_cast<std::size_t>(count);; most = all.size()) {
        most = std::min(most, all.size());
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end(),
                         [](const Candidate& a, const Candidate& b) { return detect::stronger(a.point, b.point); });
        out = coalesced({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most)}, separation);
        if (out.size() >= static_cast<std::size_t>(count) || most == all.size()) break;
    }
    if (out.size() > static_cast<std::size_t>(count)) out.resize(static_cast<std::size_t>(count));
    return out;
}

std::vector<Pixel> GatePicture::strongest_of(const PartColumns& parts, const CellSize& separation, Portion part) const {
    std::vector<Candidate> all;
    for (std::size_t s = 0; s < parts.parts.size(); ++s) {
        const std::ptrdiff_t begin = parts.parts[s].first;
        const std::ptrdiff_t end = begin + parts.parts[s].count;
        for (const std::ptrdiff_t c : parts.columns[s]) {
            if (!of(c, part)) continue;
            const Maximum* best = nullptr;
            for (std::ptrdiff_t p = begin / piece_; p * piece_ < end; ++p)
                for (const Maximum& m : (*gates_)[at(c)].pieces[at(p)])
                    if (m.power > (best != nullptr ? best->power : 0.0F) && m.azimuth >= begin && m.azimuth < end) best = &m;
            if (best != nullptr) all.push_back(candidate(source_, c, *best));
        }
    }
    std::vector<Pixel> out = coalesced(all, separation);
    if (out.size() > parts.most) out.resize(parts.most);
    return out;
}

double GatePicture::background() const {
    std::vector<double> powers;
    for (const std::ptrdiff_t c : columns_) powers.insert(powers.end(), (*gates_)[at(c)].samples.begin(), (*gates_)[at(c)].samples.end());
    return speckle_mean(std::move(powers));
}

HalfSums GatePicture::sums(Portion part) const {
    HalfSums out;
    for (const std::ptrdiff_t c : columns_)
        if (of(c, part)) out += (*gates_)[at(c)].sums;
    return out;
}

double GatePicture::entropy() const {
    quality::EntropySums out;
    for (const std::ptrdiff_t c : columns_) out += (*gates_)[at(c)].entropy;
    return out.entropy();
}

}  // namespace sarfocus::autofocus::detail

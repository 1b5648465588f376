#include "adaptive_scan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::autofocus::detail {
namespace {

constexpr std::ptrdiff_t gates_of_a_block = 128;  // 1 KiB of every line; the sums of a block stay in the first cache
constexpr std::ptrdiff_t gates_of_a_look = 16;    // compared together: rarely does one of so many exceed its gate's least kept
using Line = std::array<float, static_cast<std::size_t>(gates_of_a_block)>;

std::size_t at(std::ptrdiff_t i) {
    return static_cast<std::size_t>(i);
}

// The strongest values of each gate of a block.
class Strongest {
public:
    Strongest(std::ptrdiff_t gates, int count) : count_(at(count)), kept_(at(gates)) { least_.fill(0.0F); }

    void offer(const Line& value, std::ptrdiff_t azimuth) {
        const auto gates = static_cast<std::ptrdiff_t>(kept_.size());
        for (std::ptrdiff_t begin = 0; begin < gates; begin += gates_of_a_look) {
            int above = 0;
            for (std::ptrdiff_t g = begin; g < begin + gates_of_a_look; ++g) above |= static_cast<int>(value[at(g)] > least_[at(g)]);
            if (above == 0) continue;
            for (std::ptrdiff_t g = begin; g < std::min(begin + gates_of_a_look, gates); ++g)
                if (value[at(g)] > least_[at(g)]) insert(g, value[at(g)], azimuth);
        }
    }

    [[nodiscard]] const std::vector<std::pair<float, std::ptrdiff_t>>& of(std::ptrdiff_t gate) const { return kept_[at(gate)]; }

private:
    void insert(std::ptrdiff_t gate, float value, std::ptrdiff_t azimuth) {
        auto& list = kept_[at(gate)];
        if (list.size() == count_) list.pop_back();
        const auto place = std::find_if(list.begin(), list.end(), [&](const auto& held) { return held.first < value; });
        list.insert(place, {value, azimuth});
        if (list.size() == count_) least_[at(gate)] = list.back().first;
    }

    std::size_t count_;
    std::vector<std::vector<std::pair<float, std::ptrdiff_t>>> kept_;
    Line least_;  // a value must exceed it; zeros never count
};

// Boxes of one extent: two halves one behind the other.
class Boxes {
public:
    Boxes(int extent, std::ptrdiff_t gates, int count) : extent_(extent), strongest_(gates, count) {
        before_.fill(0.0F);
        sum_.fill(0.0F);
    }

    void add(const Line& intensity, std::ptrdiff_t i) {
        if (extent_ == 1) {
            strongest_.offer(intensity, i);
            return;
        }
        for (std::size_t g = 0; g < sum_.size(); ++g) sum_[g] += intensity[g];
        const std::ptrdiff_t half = extent_ / 2;
        if ((i + 1) % half != 0) return;
        if (i + 1 >= extent_) {
            for (std::size_t g = 0; g < sum_.size(); ++g) before_[g] += sum_[g];
            strongest_.offer(before_, i + 1 - half);
        }
        before_ = sum_;
        sum_.fill(0.0F);
    }

    void store(std::ptrdiff_t first_gate, std::ptrdiff_t gates, std::vector<std::vector<detect::Point>>& out) const {
        for (std::ptrdiff_t g = 0; g < gates; ++g)
            for (const auto& [value, azimuth] : strongest_.of(g))
                out[at(first_gate + g)].push_back({azimuth, first_gate + g, static_cast<double>(value) / extent_});
    }

private:
    int extent_;
    Strongest strongest_;
    Line before_;  // of the half before
    Line sum_;     // of the half that is being summed up
};

void load(const ImageView& block, std::ptrdiff_t i, Line& intensity) {
    const cfloat* line = block.data() + i * block.stride(0);
    const std::ptrdiff_t gates = block.extent(1);
    if (block.stride(1) == 1) {
        for (std::ptrdiff_t g = 0; g < gates; ++g) intensity[at(g)] = line[g].real() * line[g].real() + line[g].imag() * line[g].imag();
        return;
    }
    for (std::ptrdiff_t g = 0; g < gates; ++g) {
        const cfloat value = line[g * block.stride(1)];
        intensity[at(g)] = value.real() * value.real() + value.imag() * value.imag();
    }
}

void scan_block(const ImageView& image, std::ptrdiff_t first_gate, std::ptrdiff_t gates, int count, Scan& out,
                std::vector<std::vector<std::vector<detect::Point>>>& strongest) {
    const ImageView block = image.slice(1, first_gate, gates);
    std::vector<Boxes> boxes;
    for (const int extent : out.extents) boxes.emplace_back(extent, gates, count);
    Line intensity{};
    std::array<double, static_cast<std::size_t>(gates_of_a_block)> energy{};
    for (std::ptrdiff_t i = 0; i < block.extent(0); ++i) {
        load(block, i, intensity);
        for (std::size_t g = 0; g < energy.size(); ++g) energy[g] += static_cast<double>(intensity[g]);
        for (Boxes& b : boxes) b.add(intensity, i);
        if ((i + 1) % out.step != 0 && i + 1 != block.extent(0)) continue;
        std::copy_n(energy.begin(), gates, out.energy.data() + (i / out.step) * image.extent(1) + first_gate);
        energy.fill(0.0);
    }
    for (std::size_t e = 0; e < boxes.size(); ++e) boxes[e].store(first_gate, gates, strongest[e]);
}

}  // namespace

bool Scan::zero() const {
    return std::all_of(energy.begin(), energy.end(), [](double e) { return e == 0.0; });
}

Scan scan_image(const ImageView& image, std::ptrdiff_t step, const std::vector<int>& extents, int count, const Execution& execution) {
    require_not_empty(image, "image");
    const std::ptrdiff_t n_range = image.extent(1);
    Scan out;
    out.step = step;
    out.extents = extents;
    out.energy = Array<double, 2>({(image.extent(0) + step - 1) / step, n_range});
    std::vector<std::vector<std::vector<detect::Point>>> strongest(extents.size());
    for (auto& gates : strongest) gates.resize(at(n_range));
    parallel_for(execution, "scan", (n_range + gates_of_a_block - 1) / gates_of_a_block, [&](std::int64_t b) {
        const std::ptrdiff_t first = b * gates_of_a_block;
        scan_block(image, first, std::min(gates_of_a_block, n_range - first), count, out, strongest);
    });
    if (!std::all_of(out.energy.begin(), out.energy.end(), [](double e) { return std::isfinite(e); })) {
        require_finite(image, "image", execution.threads);
        throw NumericalError("image: expected pixels whose energy fits a number, got larger ones");
    }
    for (const auto& gates : strongest) {
        out.strongest.emplace_back();
        for (const auto& points : gates) out.strongest.back().insert(out.strongest.back().end(), points.begin(), points.end());
    }
    return out;
}

Array<double, 2> energies_of(const Scan& scan) {
    const std::ptrdiff_t cells = scan.energy.extent(0);
    const std::ptrdiff_t n_range = scan.energy.extent(1);
    if (cells == 1) return scan.energy.copy();
    Array<double, 2> out({cells - 1, n_range});
    for (std::ptrdiff_t s = 0; s < cells - 1; ++s)
        for (std::ptrdiff_t j = 0; j < n_range; ++j) out(s, j) = scan.energy(s, j) + scan.energy(s + 1, j);
    return out;
}

}  // namespace sarfocus::autofocus::detail

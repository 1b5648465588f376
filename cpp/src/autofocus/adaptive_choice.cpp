#include "adaptive_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <sarfocus/core/constants.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/detect/local_maxima.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {
namespace {

std::vector<std::ptrdiff_t> sorted(std::vector<std::ptrdiff_t> gates) {
    std::sort(gates.begin(), gates.end());
    gates.erase(std::unique(gates.begin(), gates.end()), gates.end());
    return gates;
}

// Gates by a strength, the greatest first, of equals the nearer.
std::vector<std::ptrdiff_t> by_strength(const std::vector<double>& strength) {
    std::vector<std::ptrdiff_t> order(strength.size());
    std::iota(order.begin(), order.end(), std::ptrdiff_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return strength[at(a)] > strength[at(b)]; });
    return order;
}

}  // namespace

Selection no_selection(std::size_t parts) {
    Selection out;
    out.gates.resize(parts);
    out.k.assign(parts, 0);
    out.mean_strong.assign(parts, 0.0);
    out.mean_rest.assign(parts, 0.0);
    return out;
}

Selection select_gates(const Scan& scan, const CfarGate& gate, int k, double eta) {
    const Array<double, 2> energies = energies_of(scan);
    Selection out = no_selection(at(energies.extent(0)));
    bool any = false;
    for (std::ptrdiff_t s = 0; s < energies.extent(0); ++s) {
        GateChoice choice = choose_gates(energies.view().row(s), k, eta);
        out.k[at(s)] = static_cast<int>(choice.gates.size());
        out.mean_strong[at(s)] = choice.mean_strong;
        out.mean_rest[at(s)] = choice.mean_rest;
        out.gates[at(s)] = sorted(std::move(choice.gates));
        any = any || !out.gates[at(s)].empty();
    }
    if (any) return out;
    std::vector<std::ptrdiff_t> detected;
    for (const GateCell& cell : gate.cells)
        if (cell.detected) detected.push_back(cell.range);
    detected = sorted(std::move(detected));
    std::fill(out.gates.begin(), out.gates.end(), detected);
    return out;
}

Selection select_fixed(const Scan& scan, int k) {
    const Array<double, 2> energies = energies_of(scan);
    const std::ptrdiff_t n = energies.extent(1);
    const std::ptrdiff_t kept = std::min<std::ptrdiff_t>(k, n);
    Selection out = no_selection(at(energies.extent(0)));
    for (std::ptrdiff_t s = 0; s < energies.extent(0); ++s) {
        const double* row = energies.data() + s * n;
        std::vector<std::ptrdiff_t> order = by_strength({row, row + n});
        double strong = 0.0;
        double rest = 0.0;
        for (std::ptrdiff_t j = 0; j < n; ++j) (j < kept ? strong : rest) += row[order[at(j)]];
        out.k[at(s)] = static_cast<int>(kept);
        out.mean_strong[at(s)] = strong / static_cast<double>(kept);
        out.mean_rest[at(s)] = n > kept ? rest / static_cast<double>(n - kept) : 0.0;
        order.resize(at(kept));
        out.gates[at(s)] = sorted(std::move(order));
    }
    return out;
}

std::vector<std::ptrdiff_t> gates_to_transform(const Scan& scan, const Selection& selection) {
    const std::ptrdiff_t n = scan.energy.extent(1);
    constexpr std::ptrdiff_t enough = 512;
    const std::ptrdiff_t most = std::min(std::max(enough, n / 8), n);
    const Array<double, 2> energies = energies_of(scan);
    std::vector<double> selected(at(n), 0.0);
    for (std::size_t s = 0; s < selection.gates.size(); ++s)
        for (const std::ptrdiff_t j : selection.gates[s])
            selected[at(j)] = std::max(selected[at(j)], energies(static_cast<std::ptrdiff_t>(s), j));
    // A point raises the sum of squares more than the energy, defocused or not.
    std::vector<double> strength(at(n), 0.0);
    if (!scan.strongest.empty())
        for (const detect::Point& p : scan.strongest.front()) strength[at(p.range)] += p.intensity * p.intensity;
    std::vector<std::ptrdiff_t> out;
    for (const std::ptrdiff_t j : by_strength(selected))
        if (selected[at(j)] > 0.0 && static_cast<std::ptrdiff_t>(out.size()) < most) out.push_back(j);
    for (const std::ptrdiff_t j : by_strength(strength))
        if (!(selected[at(j)] > 0.0) && static_cast<std::ptrdiff_t>(out.size()) < std::min(enough, n)) out.push_back(j);
    return sorted(std::move(out));
}

Array<float, 2> sign_of_mean_filter(std::ptrdiff_t gates, std::ptrdiff_t n_azimuth) {
    Array<float, 2> out({gates, n_azimuth});
    for (std::ptrdiff_t c = 0; c < gates; ++c)
        for (std::ptrdiff_t k = 0; k < n_azimuth; ++k) {
            const double response = 1.0 + 2.0 * std::cos(two_pi * static_cast<double>(k) / static_cast<double>(n_azimuth));
            out(c, k) = c > 0 && c + 1 < gates && response < 0.0 ? -1.0F : 1.0F;
        }
    return out;
}

void require_not_zero(const Scan& scan) {
    if (!scan.zero()) return;
    throw NumericalError("image: expected pixels other than zero, got all zero");
}

Result nothing_done(const ImageView& image, const char* reason, const Execution& execution) {
    Result out;
    out.threads = resolve_threads(execution.threads);
    out.estimate.assign(at(image.extent(0)), 0.0);
    out.phase_std.assign(at(image.extent(0)), std::numeric_limits<double>::quiet_NaN());
    out.score.reason = reason;
    return out;
}

void describe(const Selection& selection, const CfarGate& gate, std::vector<SubAperture> parts, double eta, Result& result) {
    AdaptiveDetails& details = result.adaptive;
    details.cells = gate.cells;
    details.amplitudes = gate.amplitudes;
    details.strong_points = gate.strong_points;
    details.eta = eta;
    for (std::size_t s = 0; s < parts.size(); ++s) {
        parts[s].gates = selection.k[s];
        parts[s].mean_strong = selection.mean_strong[s];
        parts[s].mean_rest = selection.mean_rest[s];
        for (const StrongPoint& p : result.points) {
            const auto line = std::lround(p.azimuth);
            if (line >= parts[s].first && line < parts[s].first + parts[s].count) ++parts[s].points;
        }
    }
    details.sub_apertures = std::move(parts);
}

}  // namespace sarfocus::autofocus::detail

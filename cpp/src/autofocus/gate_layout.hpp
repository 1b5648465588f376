#pragma once

#include <array>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "point_source.hpp"

namespace sarfocus::autofocus::detail {

/// An image of some range gates, ascending, all of them or the chosen ones.
class GateLayout : public PixelLayout {
public:
    GateLayout(std::ptrdiff_t n_azimuth, std::vector<std::ptrdiff_t> gates) : n_azimuth_(n_azimuth), gates_(std::move(gates)) {}
    GateLayout(std::ptrdiff_t n_azimuth, std::ptrdiff_t n_range) : n_azimuth_(n_azimuth), gates_(static_cast<std::size_t>(n_range)) {
        std::iota(gates_.begin(), gates_.end(), std::ptrdiff_t{0});
    }

    [[nodiscard]] std::array<std::ptrdiff_t, 2> shape() const override { return {n_azimuth_, static_cast<std::ptrdiff_t>(gates_.size())}; }
    [[nodiscard]] std::ptrdiff_t range_gate(std::ptrdiff_t column) const override { return gates_[static_cast<std::size_t>(column)]; }
    [[nodiscard]] bool fractional_columns() const override { return false; }
    [[nodiscard]] bool is_list() const override { return false; }

private:
    std::ptrdiff_t n_azimuth_;
    std::vector<std::ptrdiff_t> gates_;
};

}  // namespace sarfocus::autofocus::detail

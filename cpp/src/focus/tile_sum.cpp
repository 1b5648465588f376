#include "tile_sum.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

namespace sarfocus::focus::detail {
namespace {

constexpr std::ptrdiff_t tile_lanes = TileShape::lanes;
constexpr std::ptrdiff_t fewest_rows = 8;  // smaller tiles are not worth their set-up

PulseTable table_of(const PulseGroup& pulses, std::ptrdiff_t p) {
    PulseTable out{pulses.bins[p], pulses.n_bin, pulses.first_range[p], pulses.bins_per_metre, {}, {}};
    for (std::size_t d = 0; d < 3; ++d) {
        out.tx[d] = pulses.tx[d][p];
        out.rx[d] = pulses.rx[d][p];
    }
    return out;
}

void copy_to(const Vector3& v, double* out) {
    std::copy(v.begin(), v.end(), out);
}

}  // namespace

TileLattice::TileLattice(const geometry::ImageGrid& grid) : grid_(grid), shape_(grid.shape()) {
    if (shape_[0] == 1) direction_ = Lanes::along_range;
    if (!is_plane() && (shape_[0] == 1 || shape_[1] == 1)) direction_ = Lanes::folded;
    if (grid.kind() != geometry::ImageGrid::Kind::polar) return;
    for (std::ptrdiff_t i = 0; i < shape_[0]; ++i) {
        const double angle = grid.polar_axes()[2] + static_cast<double>(i) * grid.polar_axes()[3];
        cosine_.push_back(std::cos(angle));
        sine_.push_back(std::sin(angle));
    }
}

void TileLattice::turn_to(const geometry::PhaseCentres& centres, std::ptrdiff_t pulse) {
    if (shape_[0] == 1 || shape_[1] == 1) return;
    const std::array<std::ptrdiff_t, 2> first{(shape_[0] - 1) / 2, (shape_[1] - 1) / 2};
    const auto range = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
        return centres.range(pulse, grid_.position(static_cast<double>(i), static_cast<double>(j)));
    };
    const double here = range(first[0], first[1]);
    const double azimuth = std::abs(range(first[0] + 1, first[1]) - here);
    direction_ = azimuth <= std::abs(range(first[0], first[1] + 1) - here) ? Lanes::along_azimuth : Lanes::along_range;
}

std::ptrdiff_t TileLattice::rows() const {
    if (direction_ == Lanes::folded) return (grid_.size() + tile_lanes - 1) / tile_lanes;
    return direction_ == Lanes::along_azimuth ? shape_[1] : shape_[0];
}

std::ptrdiff_t TileLattice::lanes() const {
    if (direction_ == Lanes::folded) return tile_lanes;
    return direction_ == Lanes::along_azimuth ? shape_[0] : shape_[1];
}

std::optional<std::array<std::ptrdiff_t, 2>> TileLattice::strides(const MutableImageView& image) const {
    if (direction_ == Lanes::folded) return std::nullopt;
    const bool along_azimuth = direction_ == Lanes::along_azimuth;
    return std::array{image.stride(along_azimuth ? 1 : 0), image.stride(along_azimuth ? 0 : 1)};
}

bool TileLattice::contains(std::ptrdiff_t row, std::ptrdiff_t lane) const {
    return direction_ == Lanes::folded ? row * tile_lanes + lane < grid_.size() : row < rows() && lane < lanes();
}

std::array<std::ptrdiff_t, 2> TileLattice::pixel(std::ptrdiff_t row, std::ptrdiff_t lane) const {
    if (direction_ == Lanes::folded) {
        const std::ptrdiff_t k = row * tile_lanes + lane;
        return {k / shape_[1], k % shape_[1]};
    }
    return direction_ == Lanes::along_azimuth ? std::array{lane, row} : std::array{row, lane};
}

Vector3 TileLattice::position(std::ptrdiff_t row, std::ptrdiff_t lane) const {
    const auto at = pixel(row, lane);
    if (cosine_.empty()) return grid_.pixel_position(at[0], at[1]);
    const auto& [centre, range_direction, azimuth_direction] = grid_.vectors();
    const double range = grid_.polar_axes()[0] + static_cast<double>(at[1]) * grid_.polar_axes()[1];
    const auto angle = static_cast<std::size_t>(at[0]);
    return centre + (range * cosine_[angle]) * range_direction + (range * sine_[angle]) * azimuth_direction;
}

PlaneTile TileLattice::plane_tile(std::ptrdiff_t first_row, std::ptrdiff_t rows, std::ptrdiff_t first_lane) const {
    const bool along_azimuth = direction_ == Lanes::along_azimuth;
    const double row = static_cast<double>(first_row) + 0.5 * static_cast<double>(rows - 1);
    const double lane = static_cast<double>(first_lane) + 0.5 * static_cast<double>(tile_lanes - 1);
    PlaneTile tile{};
    copy_to(along_azimuth ? grid_.position(lane, row) : grid_.position(row, lane), tile.centre);
    copy_to(grid_.vectors()[along_azimuth ? 2 : 1], tile.row_step);
    copy_to(grid_.vectors()[along_azimuth ? 1 : 2], tile.lane_step);
    tile.rows = rows;
    return tile;
}

void TileLattice::fill(std::ptrdiff_t first_row, std::ptrdiff_t rows, std::ptrdiff_t first_lane, std::ptrdiff_t run,
                       PointTile& tile) const {
    const bool whole = contains(first_row + rows - 1, first_lane + tile_lanes - 1);
    const auto nearest_pixel = [&](std::ptrdiff_t row, std::ptrdiff_t lane) {  // in place of those outside the image
        if (whole || contains(row, lane)) return position(row, lane);
        return contains(row, first_lane) ? position(row, first_lane) : position(first_row, first_lane);
    };
    const Vector3 centre = nearest_pixel(first_row + rows / 2, first_lane + tile_lanes / 2);
    copy_to(centre, tile.centre);
    tile.rows = rows;
    double most = 0.0;
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
        for (std::ptrdiff_t j = 0; j < tile_lanes; ++j) {
            const Vector3 offset = nearest_pixel(first_row + i, first_lane + j) - centre;
            const std::ptrdiff_t k = i * tile_lanes + j;
            const double square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
            for (std::size_t d = 0; d < 3; ++d) tile.offset[d][k] = static_cast<float>(offset[d]);
            tile.square[k] = static_cast<float>(square);
            most = std::max(most, square);
        }
    }
    tile.radius = std::sqrt(most);
    for (std::ptrdiff_t i = 0; i < TileShape::pixels / run; ++i) {
        const std::ptrdiff_t k = std::min(i * run, rows * tile_lanes - run);
        tile.length_square[i] = 0.0f;
        for (std::size_t d = 0; d < 3; ++d) {
            const float* x = tile.offset[d] + k;
            const float along = (x[run - 1] - x[0]) / static_cast<float>(run - 1);
            float off = 0.0f;
            for (std::ptrdiff_t j = 0; j < run; ++j) off = std::max(off, std::abs(x[j] - x[0] - static_cast<float>(j) * along));
            tile.ends[0][d][i] = x[0];
            tile.ends[1][d][i] = x[run - 1];
            tile.box[d][i] = off;
            tile.length_square[i] += (x[run - 1] - x[0]) * (x[run - 1] - x[0]);
        }
    }
}

void TileSum::sum(const PulseGroup& pulses, const TileArea& area, bool add, const MutableImageView& image, TileMemory& own) const {
    for (std::ptrdiff_t lane = area.first_lane; lane < area.first_lane + area.lanes; lane += tile_lanes) {
        const Part part{area.first_row, area.rows, lane, own.re, own.im};
        if (add) fetch(part, std::min(tile_lanes, area.first_lane + area.lanes - lane), image);
        std::fill_n(own.re, area.rows * tile_lanes, 0.0f);
        std::fill_n(own.im, area.rows * tile_lanes, 0.0f);
        add_tile(pulses, ~PulseMask{0} >> (PulseGroup::capacity - pulses.count), part, own);
        store(part, std::min(tile_lanes, area.first_lane + area.lanes - lane), add, image);
    }
}

void TileSum::add_tile(const PulseGroup& pulses, PulseMask wanted, const Part& part, TileMemory& own) const {
    PulseMask left = wanted;
    if (lattice_.is_plane())
        left =
            kernels_.add_plane(pulses, wanted, lattice_.plane_tile(part.first_row, part.rows, part.first_lane), aspect_, part.re, part.im);
    if (left == 0) return;
    const std::ptrdiff_t half = part.rows / 2;
    const bool smaller = lattice_.is_plane() && half >= (aspect_ != nullptr ? fewest_rows : 2 * fewest_rows);
    if (smaller) {
        add_tile(pulses, left, {part.first_row, half, part.first_lane, part.re, part.im}, own);
        add_tile(pulses, left,
                 {part.first_row + half, part.rows - half, part.first_lane, part.re + half * tile_lanes, part.im + half * tile_lanes}, own);
    } else if (aspect_ != nullptr) {
        add_one_by_one(pulses, left, part, own);
    } else {
        add_points(pulses, left, part, own);
    }
}

void TileSum::add_points(const PulseGroup& pulses, PulseMask wanted, const Part& part, TileMemory& own) const {
    lattice_.fill(part.first_row, part.rows, part.first_lane, kernels_.run, own.points);
    const PulseMask left = kernels_.add_points(pulses, wanted, own.points, part.re, part.im);
    if (left == 0) return;
    const std::ptrdiff_t half = part.rows / 2;
    if (half >= fewest_rows) {
        add_points(pulses, left, {part.first_row, half, part.first_lane, part.re, part.im}, own);
        add_points(pulses, left,
                   {part.first_row + half, part.rows - half, part.first_lane, part.re + half * tile_lanes, part.im + half * tile_lanes},
                   own);
    } else {
        add_one_by_one(pulses, left, part, own);
    }
}

// With the range of every pixel in double precision.
void TileSum::add_one_by_one(const PulseGroup& pulses, PulseMask wanted, const Part& part, TileMemory& own) const {
    constexpr std::ptrdiff_t rows_at_once = PixelBlock::capacity / tile_lanes;
    PixelBlock& pixels = own.pixels;
    for (std::ptrdiff_t first = 0; first < part.rows; first += rows_at_once) {
        pixels.count = std::min(rows_at_once, part.rows - first) * tile_lanes;
        for (std::ptrdiff_t k = 0; k < pixels.count; ++k) {
            const std::ptrdiff_t row = part.first_row + first + k / tile_lanes;
            const std::ptrdiff_t lane = part.first_lane + k % tile_lanes;
            const Vector3 at =
                lattice_.contains(row, lane) ? lattice_.position(row, lane) : lattice_.position(part.first_row, part.first_lane);
            pixels.x[k] = at[0];
            pixels.y[k] = at[1];
            pixels.z[k] = at[2];
        }
        float* re = part.re + first * tile_lanes;
        float* im = part.im + first * tile_lanes;
        for (std::ptrdiff_t p = 0; p < pulses.count; ++p) {
            if ((wanted >> p & 1U) == 0) continue;
            if (aspect_ == nullptr)
                kernels_.gather(table_of(pulses, p), pixels, pulses.cycles_per_metre, pulses.monostatic, re, im);
            else
                kernels_.gather_weighted(table_of(pulses, p), pixels, *aspect_, pulses.cycles_per_metre, pulses.monostatic, re, im);
        }
    }
}

// What `store` will add to comes into the cache while the sums are made.
void TileSum::fetch(const Part& part, std::ptrdiff_t lanes, const MutableImageView& image) const {
    const auto strides = lattice_.strides(image);
    if (!strides) return;
    const auto [row, lane] = *strides;
    constexpr std::ptrdiff_t cache_line = 64 / sizeof(cfloat);
    const std::ptrdiff_t rows = std::min(part.rows, lattice_.rows() - part.first_row);
    lanes = std::min(lanes, lattice_.lanes() - part.first_lane);
    for (std::ptrdiff_t j = 0; j < lanes; j += std::abs(lane) == 1 ? cache_line : 1)
        for (std::ptrdiff_t i = 0; i < rows; i += std::abs(row) == 1 ? cache_line : 1)
            __builtin_prefetch(image.data() + (part.first_row + i) * row + (part.first_lane + j) * lane, 1, 2);
}

// `store` where the rows of a tile are next to one another in the image, and rows and lanes are multiples of four: four by four at a time,
// put across in registers.
void TileSum::store_across(const Part& part, std::ptrdiff_t lanes, std::ptrdiff_t rows, bool add, cfloat* image,
                           std::ptrdiff_t lane_stride) {
    using Four = float __attribute__((vector_size(16)));
    using FourInMemory = float __attribute__((vector_size(16), aligned(4), may_alias));
    for (std::ptrdiff_t j = 0; j < lanes; j += 4)
        for (std::ptrdiff_t i = 0; i < rows; i += 4) {
            Four pairs[4][2];  // of lanes, (re, im, re, im)
            for (std::ptrdiff_t r = 0; r < 4; ++r) {
                const Four re = *reinterpret_cast<const FourInMemory*>(part.re + (i + r) * tile_lanes + j);
                const Four im = *reinterpret_cast<const FourInMemory*>(part.im + (i + r) * tile_lanes + j);
                pairs[r][0] = __builtin_shufflevector(re, im, 0, 4, 1, 5);
                pairs[r][1] = __builtin_shufflevector(re, im, 2, 6, 3, 7);
            }
            for (std::ptrdiff_t l = 0; l < 4; ++l)
                for (std::ptrdiff_t r = 0; r < 4; r += 2) {
                    const Four a = pairs[r][l / 2];
                    const Four b = pairs[r + 1][l / 2];
                    const Four sum = l % 2 == 0 ? __builtin_shufflevector(a, b, 0, 1, 4, 5) : __builtin_shufflevector(a, b, 2, 3, 6, 7);
                    auto& to = *reinterpret_cast<FourInMemory*>(image + (j + l) * lane_stride + i + r);
                    to = add ? to + sum : sum;
                }
        }
}

void TileSum::store(const Part& part, std::ptrdiff_t lanes, bool add, const MutableImageView& image) const {
    const auto put = [&](cfloat& pixel, std::ptrdiff_t i, std::ptrdiff_t j) {
        const cfloat sum(part.re[i * tile_lanes + j], part.im[i * tile_lanes + j]);
        pixel = add ? pixel + sum : sum;
    };
    if (const auto strides = lattice_.strides(image)) {
        const auto [row, lane] = *strides;
        const std::ptrdiff_t rows = std::min(part.rows, lattice_.rows() - part.first_row);
        lanes = std::min(lanes, lattice_.lanes() - part.first_lane);
        if (row == 1 && lanes % 4 == 0 && rows % 4 == 0)
            return store_across(part, lanes, rows, add, image.data() + part.first_row + part.first_lane * lane, lane);
        for (std::ptrdiff_t j = 0; j < lanes; ++j) {
            cfloat* to = image.data() + part.first_row * row + (part.first_lane + j) * lane;
            for (std::ptrdiff_t i = 0; i < rows; ++i) put(to[i * row], i, j);
        }
        return;
    }
    for (std::ptrdiff_t j = 0; j < lanes; ++j)
        for (std::ptrdiff_t i = 0; i < part.rows; ++i) {
            if (!lattice_.contains(part.first_row + i, part.first_lane + j)) continue;
            const auto at = lattice_.pixel(part.first_row + i, part.first_lane + j);
            put(image(at[0], at[1]), i, j);
        }
}

}  // namespace sarfocus::focus::detail

// What factorised backprojection decides before it starts: tiles, sub-apertures, kernels, and the error they will make.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <sarfocus/focus/factorized.hpp>

#include "focus/band_kernel.hpp"
#include "focus/virtual_track.hpp"

namespace sarfocus::focus::detail {

/// The grid with its columns along the axis on which ranges change most.
class PixelFrame {
public:
    PixelFrame(const geometry::ImageGrid& grid, bool swapped);

    [[nodiscard]] bool swapped() const { return swapped_; }
    [[nodiscard]] std::ptrdiff_t rows() const { return grid_->shape()[swapped_ ? 1 : 0]; }
    [[nodiscard]] std::ptrdiff_t columns() const { return grid_->shape()[swapped_ ? 0 : 1]; }
    [[nodiscard]] Vector3 position(double i, double j) const { return swapped_ ? grid_->position(j, i) : grid_->position(i, j); }
    /// From one column to the next, m: rows are straight, and evenly spaced.
    [[nodiscard]] Vector3 along_row(double i) const { return position(i, 1.0) - position(i, 0.0); }
    /// Two orthonormal vectors of the plane in which the pixels lie.
    [[nodiscard]] const Vector3& axis(std::size_t k) const { return axes_[k]; }

private:
    const geometry::ImageGrid* grid_;
    bool swapped_;
    std::array<Vector3, 2> axes_;
};

/// A rectangle of pixels.
struct Tile {
    std::ptrdiff_t row = 0;
    std::ptrdiff_t column = 0;
    std::ptrdiff_t rows = 0;
    std::ptrdiff_t columns = 0;
    Vector3 centre{};

    Tile() = default;
    Tile(const PixelFrame& frame, std::ptrdiff_t first_row, std::ptrdiff_t first_column, std::ptrdiff_t most_rows,
         std::ptrdiff_t most_columns);
};

/// Least and greatest range of a tile's pixels, less that of its centre, over the given antennas; m, on the safe side.
struct Extent {
    double low;
    double high;
};
[[nodiscard]] Extent extent_of(const PixelFrame& frame, const Tile& tile, const Antennas* antennas, std::size_t n, std::size_t step,
                               bool monostatic);

[[nodiscard]] inline double range_of(const Antennas& a, const Vector3& p, bool monostatic) {
    const double forth = norm(p - a.tx);
    return monostatic ? forth : 0.5 * (forth + norm(p - a.rx));
}

/// Positions of antennas, one array for each coordinate.
struct AntennaArrays {
    std::vector<double> tx[3];
    std::vector<double> rx[3];

    explicit AntennaArrays(const std::vector<Antennas>& antennas);
};

/// The lines of one level: virtual phase centres at parameter first + n * step of the track, for tiles of rows x columns pixels.
struct Level {
    std::ptrdiff_t rows = 0;
    std::ptrdiff_t columns = 0;
    double oversampling = 1.0;
    double first = 0.0;
    double step = 0.0;
    std::vector<Antennas> centres;
    std::unique_ptr<AntennaArrays> arrays;
    std::unique_ptr<BandKernel> kernel;  ///< from the level before (pulses, for the first) onto these centres
    std::ptrdiff_t margin = 0;           ///< samples of a line in front of its tile
    std::ptrdiff_t margin_behind = 0;    ///< and behind it: lines of the next level are whole registers long
    std::ptrdiff_t most_width = 0;       ///< samples of a line, no tile's are wider

    /// For each centre: which lines of the level before add to it, and by what. Empty at the first level.
    struct Sources {
        std::ptrdiff_t first = 0;
        std::vector<float> weights;
    };
    std::vector<Sources> sources;

    [[nodiscard]] std::ptrdiff_t n_centre() const { return static_cast<std::ptrdiff_t>(centres.size()); }
};

/// A piece of the path with its sub-apertures.
struct Piece {
    std::vector<std::ptrdiff_t> pulses;  ///< by their place along the track
    std::vector<double> along;           ///< their parameter
    bool off_track = false;              ///< whether pulses lie beside the track by more than the phase can bear
    std::shared_ptr<const VirtualTrack> track;
    std::vector<Level> levels;
};

struct RootTile {
    Tile tile;
    bool factorized = true;
    double edge_share = 0.0;  ///< of the pulses, those whose record begins or ends within the tile: their terms are summed one by one
};

struct Plan {
    std::string exact_because;  ///< empty: factorise
    std::unique_ptr<PixelFrame> frame;
    std::vector<Piece> pieces;
    std::vector<RootTile> roots;
    std::unique_ptr<BandKernel> range_kernel;
    std::unique_ptr<BandCubic> cubic;
    std::ptrdiff_t row_phases = 1;  ///< bins a pixel
    double spacing = 0.0;           ///< m, of the samples of lines: half that of the data
    double cycles_per_metre = 0.0;
    double predicted_error = 0.0;  ///< amplitude
    double work = 0.0;             ///< cycles of one processor, roughly
    double exact_work = 0.0;
    std::vector<std::size_t> groups;  ///< first root tile of each group, and the number of tiles at the end
    std::uint64_t memory = 0;
    bool monostatic = true;
};

constexpr std::ptrdiff_t line_upsample = 2;   ///< samples of a line for each sample of the data
constexpr std::ptrdiff_t guard_samples = 40;  ///< of the data, before and behind the record
constexpr std::ptrdiff_t block_pulses = 64;   ///< whose lines are held at a time

/// Pulses whose upsampled lines of `width` samples are held at a time: as many as take 8 MiB, in whole blocks.
[[nodiscard]] constexpr std::ptrdiff_t held_pulses(std::ptrdiff_t width) {
    const std::ptrdiff_t blocks = (std::ptrdiff_t{1} << 23) / (static_cast<std::ptrdiff_t>(2 * sizeof(float)) * width * block_pulses);
    return block_pulses * (blocks < 1 ? 1 : blocks > 16 ? 16 : blocks);
}

[[nodiscard]] Plan make_plan(const RangeProfiles& profiles, const geometry::PhaseCentres& centres, const geometry::ImageGrid& grid,
                             const FactorizedOptions& options);

[[nodiscard]] FactorizedReport report_of(const Plan& plan);

}  // namespace sarfocus::focus::detail

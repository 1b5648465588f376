#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <sarfocus/detect/local_maxima.hpp>
#include <sarfocus/quality/image_measures.hpp>

#include "strip_lines.hpp"

namespace sarfocus::autofocus::detail {

double speckle_mean(std::vector<double> powers) {
    const auto middle = powers.begin() + static_cast<std::ptrdiff_t>(powers.size() / 2);
    std::nth_element(powers.begin(), middle, powers.end());
    return *middle / std::log(2.0);
}

std::unique_ptr<Picture> PointSource::picture(const PictureRequest& /*request*/, const Execution& execution) {
    return std::make_unique<WholePicture>(*this, execution);
}

WholePicture::WholePicture(PointSource& source, MutableImageView image, const Execution& execution)
    : source_(source), execution_(execution), image_(image) {}

WholePicture::WholePicture(PointSource& source, const Execution& execution)
    : source_(source), execution_(execution), memory_({source.shape()[0], source.shape()[1]}), image_(memory_.view()) {}

void WholePicture::focus(const std::vector<double>& phase, const Look& /*look*/) {
    source_.form(phase, image_, execution_);
}

Array<bool, 2> WholePicture::wanted(Portion part) const {
    return part == Portion::everywhere ? Array<bool, 2>() : halves_->mask(static_cast<int>(part));
}

std::vector<Pixel> WholePicture::strongest(int count, const CellSize& separation, Portion part) const {
    return strongest_points(image_, source_, count, separation, wanted(part).view(), execution_);
}

std::vector<Pixel> WholePicture::strongest_of(const PartColumns& parts, const CellSize& separation, Portion part) const {
    const ImageView image = image_;
    const Array<bool, 2> own = wanted(part);
    const std::ptrdiff_t n_column = image.extent(1);
    std::vector<std::vector<detect::Point>> found(parts.parts.size());
    parallel_for(execution_, "choose points", static_cast<std::int64_t>(parts.parts.size()), [&](std::int64_t s) {
        const SubAperture& lines = parts.parts[at(s)];
        std::vector<float> best(at(n_column), 0.0F);
        std::vector<std::ptrdiff_t> line(at(n_column), -1);
        for (std::ptrdiff_t i = lines.first; i < lines.first + lines.count; ++i)
            for (const std::ptrdiff_t c : parts.columns[at(s)]) {
                const cfloat value = image(i, c);
                const float intensity = value.real() * value.real() + value.imag() * value.imag();
                if (!(intensity > best[at(c)]) || (!own.empty() && !own(i, c))) continue;
                best[at(c)] = intensity;
                line[at(c)] = i;
            }
        for (const std::ptrdiff_t c : parts.columns[at(s)])
            if (line[at(c)] >= 0) found[at(s)].push_back({line[at(c)], source_.range_gate(c), static_cast<double>(best[at(c)])});
    });
    std::vector<detect::Point> points;
    for (const auto& of_part : found) points.insert(points.end(), of_part.begin(), of_part.end());
    points = detect::coalesce(std::move(points), reach_of(separation));
    if (points.size() > parts.most) points.resize(parts.most);
    return to_pixels(points, image, source_);
}

double WholePicture::background() const {
    constexpr std::ptrdiff_t at_most = 65536;
    const std::ptrdiff_t step = std::max<std::ptrdiff_t>(image_.size() / at_most, 1);
    std::vector<double> powers;
    for (std::ptrdiff_t k = 0; k < image_.size(); k += step)
        powers.push_back(std::norm(cdouble(image_(k / image_.extent(1), k % image_.extent(1)))));
    return speckle_mean(std::move(powers));
}

HalfSums WholePicture::sums(Portion part) const {
    if (part != Portion::everywhere) return sums_of(image_, *halves_, static_cast<int>(part));
    HalfSums out;
    for (std::ptrdiff_t i = 0; i < image_.extent(0); ++i)
        for (std::ptrdiff_t j = 0; j < image_.extent(1); ++j) out.add(std::norm(cdouble(image_(i, j))));
    return out;
}

double WholePicture::entropy() const {
    return quality::entropy(image_, execution_);
}

}  // namespace sarfocus::autofocus::detail

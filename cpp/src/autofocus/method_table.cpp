#include "method_table.hpp"

#include <sarfocus/autofocus/adaptive.hpp>
#include <sarfocus/autofocus/pga.hpp>
#include <sarfocus/autofocus/pga_2d.hpp>
#include <sarfocus/autofocus/sharpness.hpp>
#include <sarfocus/autofocus/spga.hpp>
#include <sarfocus/focus/azimuth.hpp>

namespace sarfocus::autofocus::detail {
namespace {

template <class Options>
Options options_for(bool judge, const Execution& execution) {
    Options out;
    out.do_no_harm = judge;
    out.execution = execution;
    return out;
}

template <class Options, Result (*function)(const ImageView&, MutableImageView, const Options&)>
Result spotlight(const Subject& subject, MutableImageView corrected, bool judge, const Execution& execution) {
    return function(subject.image, corrected, options_for<Options>(judge, execution));
}

template <class Options, Result (*function)(const ImageView&, const geometry::StripmapGeometry&, MutableImageView, const Options&)>
Result strip(const Subject& subject, MutableImageView corrected, bool judge, const Execution& execution) {
    return function(subject.image, *subject.geometry, corrected, options_for<Options>(judge, execution));
}

Result two_dimensional(const Subject& subject, MutableImageView corrected, bool judge, const Execution& execution) {
    Pga2dOptions options;
    options.points = options_for<PointOptions>(judge, execution);
    return pga_2d(subject.image, corrected, options);
}

}  // namespace

const std::vector<Method>& methods_of(Scene scene) {
    static const std::vector<Method> of_spotlight = {
        {"pga", spotlight<PointOptions, pga>},
        {"adaptive_pga", spotlight<AdaptiveOptions, adaptive_pga>},
        {"conventional_pga", spotlight<ConventionalOptions, conventional_pga>},
        {"pga_2d", two_dimensional},
        {"minimum_entropy", spotlight<SharpnessOptions, minimum_entropy>},
        {"maximum_contrast", spotlight<SharpnessOptions, maximum_contrast>},
    };
    static const std::vector<Method> of_strip = {
        {"spga_linear", strip<SpgaLinearOptions, spga_linear>},
        {"adaptive_pga", strip<AdaptiveOptions, adaptive_pga>},
        {"spga", strip<SpgaOptions, spga>},
        {"conventional_pga", strip<ConventionalOptions, conventional_pga>},
        {"minimum_entropy", strip<SharpnessOptions, minimum_entropy>},
        {"maximum_contrast", strip<SharpnessOptions, maximum_contrast>},
    };
    return scene == Scene::strip ? of_strip : of_spotlight;
}

void take_out(const Subject& subject, const std::vector<double>& phase, MutableImageView corrected, const Execution& execution) {
    if (subject.geometry == nullptr) {
        correct_azimuth_spectrum(subject.image, phase, corrected, execution);
        return;
    }
    focus::AzimuthCorrectOptions options;
    options.execution = execution;
    const ArrayView<const double, 2> row(phase.data(), {1, static_cast<std::ptrdiff_t>(phase.size())});
    focus::azimuth_correct(subject.image, *subject.geometry, row, {0.0}, corrected, options);
}

}  // namespace sarfocus::autofocus::detail

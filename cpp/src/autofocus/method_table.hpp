#pragma once

#include <vector>

#include <sarfocus/autofocus/autofocus.hpp>

namespace sarfocus::autofocus::detail {

/// An image and, for a strip, the geometry of its collection (else null).
struct Subject {
    ImageView image;
    const geometry::StripmapGeometry* geometry = nullptr;

    [[nodiscard]] Scene scene() const { return geometry != nullptr ? Scene::strip : Scene::spotlight; }
};

/// A method with its defaults. judge: whether it may hand its input back.
struct Method {
    const char* name;
    Result (*run)(const Subject& subject, MutableImageView corrected, bool judge, const Execution& execution);
};

/// In the order in which they are trusted.
[[nodiscard]] const std::vector<Method>& methods_of(Scene scene);

/// The image without a phase error of the kind that the methods for it find. phase: [n_azimuth], rad.
void take_out(const Subject& subject, const std::vector<double>& phase, MutableImageView corrected, const Execution& execution);

}  // namespace sarfocus::autofocus::detail

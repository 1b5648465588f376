// The arguments of the bindings that estimate a motion.
#pragma once

#include <string>

#include <sarfocus/autofocus/trajectory.hpp>
#include <sarfocus/core/error.hpp>

namespace sarfocus::python {

inline autofocus::TrajectoryUnknowns unknowns_of(const std::string& name) {
    using autofocus::TrajectoryUnknowns;
    if (name == "height") return TrajectoryUnknowns::height;
    if (name == "cross_track") return TrajectoryUnknowns::cross_track;
    if (name == "full") return TrajectoryUnknowns::full;
    throw ValueError("unknowns", R"("height", "cross_track" or "full")", "\"" + name + "\"");
}

inline autofocus::PixelChoice pixels_of(const std::string& name) {
    if (name == "joint") return autofocus::PixelChoice::joint;
    if (name == "brightest") return autofocus::PixelChoice::brightest;
    throw ValueError("pixels", R"("joint" or "brightest")", "\"" + name + "\"");
}

}  // namespace sarfocus::python

// A table of contents: one bind_<module>.cpp for each module of the library, one submodule of sarfocus._core for each.
#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
    m.doc() = "Compiled core of sarfocus; use the names of the sarfocus package, which are these.";
    m.attr("__version__") = SARFOCUS_VERSION;
    using namespace sarfocus::python;
    bind_core(m);
    bind_geometry(m.def_submodule("geometry", "Where the radar was and where the pixels lie."));
    bind_signal(m.def_submodule("signal", "Chirps, windows, interpolation."));
    bind_quality(m.def_submodule("quality", "Measures of focus."));
    bind_detect(m.def_submodule("detect", "Strong points and range gates."));
    bind_sim(m.def_submodule("sim", "Simulated echoes: the forward model, independent of the image formation."));
    pybind11::module_ focus = m.def_submodule("focus", "Image formation.");
    bind_focus(focus);
    bind_compress(focus);
    pybind11::module_ autofocus = m.def_submodule("autofocus", "Phase error estimation and correction.");
    bind_autofocus(autofocus);
    bind_sharpness(autofocus);
    bind_method_choice(autofocus);
    bind_adaptive(m.def_submodule("adaptive", "Scene-adaptive autofocus, and its steps one by one."));
    bind_trajectory(autofocus);
    bind_ridges(autofocus);
    pybind11::module_ strip = m.def_submodule("strip", "Stripmap autofocus, and its steps one by one.");
    bind_strip(strip);
    bind_cross_track(strip);
    pybind11::module_ hrws = m.def_submodule("hrws", "Multichannel strips: motion and unambiguous images.");
    bind_hrws(hrws);
    bind_hrws_motion(hrws);
}

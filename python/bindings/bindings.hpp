#pragma once

#include <pybind11/pybind11.h>

namespace sarfocus::python {

void bind_core(pybind11::module_ m);
void bind_geometry(pybind11::module_ m);
void bind_signal(pybind11::module_ m);
void bind_quality(pybind11::module_ m);
void bind_detect(pybind11::module_ m);
void bind_sim(pybind11::module_ m);
void bind_focus(pybind11::module_ m);
void bind_compress(pybind11::module_ m);
void bind_autofocus(pybind11::module_ m);
void bind_method_choice(pybind11::module_ m);
void bind_adaptive(pybind11::module_ m);
void bind_sharpness(pybind11::module_ m);
void bind_cross_track(pybind11::module_ m);
void bind_trajectory(pybind11::module_ m);
void bind_ridges(pybind11::module_ m);
void bind_strip(pybind11::module_ m);
void bind_hrws(pybind11::module_ m);
void bind_hrws_motion(pybind11::module_ m);

}  // namespace sarfocus::python

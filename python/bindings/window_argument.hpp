// window= of every binding.
#pragma once

#include <sarfocus/signal/window.hpp>

#include "convert.hpp"

namespace sarfocus::python {

/// None, a name, or a tuple (name, parameters …): "rectangular", "hann", "hamming", ("taylor", nbar, sidelobe_level), ("kaiser", beta).
/// Throws TypeError or ValueError.
signal::Window window_of(const py::object& window);

}  // namespace sarfocus::python

#pragma once

#include <pybind11/pybind11.h>

#include <sarfocus/autofocus/result.hpp>

namespace sarfocus::python {

/// result.image beside what the library returns.
struct PythonResult {
    pybind11::object image;
    autofocus::Result result;
};

/// result.diagnostics: decisions, seams, times, as plain data.
[[nodiscard]] pybind11::dict diagnostics(const autofocus::Result& result);

}  // namespace sarfocus::python

#include "window_argument.hpp"

#include <string>

namespace sarfocus::python {
namespace {

constexpr const char* expected = "None, \"rectangular\", \"hann\", \"hamming\", (\"taylor\", nbar, sidelobe_level) or (\"kaiser\", beta)";

[[noreturn]] void refuse(const py::object& window) {
    throw ValueError("window", expected, py::str(py::repr(window)).cast<std::string>());
}

signal::Window named(const std::string& name, const py::object& window) {
    using signal::WindowKind;
    if (name == "rectangular") return {WindowKind::rectangular};
    if (name == "hann") return {WindowKind::hann};
    if (name == "hamming") return {WindowKind::hamming};
    if (name == "taylor") return {WindowKind::taylor};
    if (name == "kaiser") return {WindowKind::kaiser};
    refuse(window);
}

}  // namespace

signal::Window window_of(const py::object& window) {
    if (window.is_none()) return {};
    if (py::isinstance<py::str>(window)) return named(window.cast<std::string>(), window);
    if (!py::isinstance<py::tuple>(window)) throw py::type_error(std::string("window: expected ") + expected);
    const auto parts = window.cast<py::tuple>();
    if (parts.empty() || !py::isinstance<py::str>(parts[0])) refuse(window);
    signal::Window out = named(parts[0].cast<std::string>(), window);
    try {
        if (out.kind == signal::WindowKind::taylor && parts.size() == 3) {
            out.nbar = parts[1].cast<int>();
            out.sidelobe_level = parts[2].cast<double>();
        } else if (out.kind == signal::WindowKind::kaiser && parts.size() == 2) {
            out.beta = parts[1].cast<double>();
        } else if (parts.size() != 1) {
            refuse(window);
        }
    } catch (const py::cast_error&) {
        refuse(window);
    }
    out.validate();
    return out;
}

}  // namespace sarfocus::python

#include "convert.hpp"

#include <algorithm>
#include <cstdint>

namespace sarfocus::python {
namespace {

std::string type_name(const py::object& object) {
    return py::str(py::type::of(object).attr("__name__")).cast<std::string>();
}

bool whole_strides(const py::array& array, std::size_t item_size) {
    const auto size = static_cast<py::ssize_t>(item_size);
    for (py::ssize_t d = 0; d < array.ndim(); ++d)
        if (array.shape(d) > 1 && array.strides(d) % size != 0) return false;
    return reinterpret_cast<std::uintptr_t>(array.data()) % std::min<std::size_t>(item_size, alignof(double)) == 0;
}

std::pair<std::uintptr_t, std::uintptr_t> memory_range(const py::array& array) {
    auto low = reinterpret_cast<std::uintptr_t>(array.data());
    std::uintptr_t high = low + static_cast<std::uintptr_t>(array.itemsize());
    for (py::ssize_t d = 0; d < array.ndim(); ++d) {
        const py::ssize_t reach = (array.shape(d) - 1) * array.strides(d);
        (reach < 0 ? low : high) += static_cast<std::uintptr_t>(reach);
    }
    return {low, high};
}

}  // namespace

py::array require_array(const py::object& object, const char* argument, const py::dtype& dtype) {
    const std::string expected =
        std::string(argument) + ": expected a NumPy array of dtype " + py::str(dtype.attr("name")).cast<std::string>() + ", got ";
    if (!py::isinstance<py::array>(object)) throw py::type_error(expected + type_name(object));
    auto array = py::reinterpret_borrow<py::array>(object);
    if (!array.dtype().equal(dtype)) throw py::type_error(expected + py::str(array.dtype()).cast<std::string>());
    return array;
}

void throw_dimensions(const char* argument, std::size_t expected, const py::array& actual) {
    throw ShapeError(argument, std::to_string(expected) + (expected == 1 ? " dimension" : " dimensions"),
                     "shape " + py::str(actual.attr("shape")).cast<std::string>());
}

py::array readable(const py::array& array, std::size_t item_size) {
    if (whole_strides(array, item_size)) return array;
    return array.attr("copy")().cast<py::array>();
}

void require_writable(const py::array& array, const char* argument, std::size_t item_size) {
    if (!array.writeable()) throw ValueError(argument, "a writable array", "a read-only one");
    if (!whole_strides(array, item_size)) throw ValueError(argument, "aligned memory with strides in whole elements", "other strides");
}

void require_no_overlap(const py::array& a, const char* a_name, const py::array& b, const char* b_name) {
    if (a.size() == 0 || b.size() == 0) return;
    const auto [a_low, a_high] = memory_range(a);
    const auto [b_low, b_high] = memory_range(b);
    if (a_low < b_high && b_low < a_high)
        throw ValueError(a_name, std::string("memory that does not overlap ") + b_name, "overlapping memory");
}

Execution execution(int threads, const py::object& progress) {
    if (!progress.is_none() && PyCallable_Check(progress.ptr()) == 0)
        throw py::type_error("progress: expected a callable (phase, done, total) or None, got " + type_name(progress));
    Execution out;
    out.threads = threads;
    (void)resolve_threads(threads);
    // The caller's stack keeps `progress` alive as long as the computation runs: a raw handle needs no reference count changed without the
    // GIL.
    const PyObject* callback = progress.is_none() ? nullptr : progress.ptr();
    out.progress = [callback](const ProgressUpdate& update) {
        const py::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        if (callback == nullptr) return true;
        const py::object answer = py::handle(const_cast<PyObject*>(callback))(update.phase, update.done, update.total);
        return answer.is_none() || answer.cast<bool>();
    };
    return out;
}

}  // namespace sarfocus::python

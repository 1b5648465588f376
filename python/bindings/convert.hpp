// From Python objects to views and back. Every array argument of every binding passes through here, so that all refuse the same
// things with the same words: wrong dtype, wrong number of dimensions, read-only or overlapping output.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <sarfocus/core/array.hpp>
#include <sarfocus/core/array_view.hpp>
#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/execution.hpp>

namespace sarfocus::python {

namespace py = pybind11;

/// Throws TypeError «argument: expected …, got …» unless `object` is a NumPy array of exactly `dtype`; nothing is converted.
py::array require_array(const py::object& object, const char* argument, const py::dtype& dtype);
[[noreturn]] void throw_dimensions(const char* argument, std::size_t expected, const py::array& actual);
/// The array itself, or an aligned contiguous copy where its memory can't be read with strides in whole, aligned elements.
py::array readable(const py::array& array, std::size_t item_size);
/// Throws TypeError or ValueError unless the array can be written in place.
void require_writable(const py::array& array, const char* argument, std::size_t item_size);
/// Throws ValueError where the memory of two arrays may overlap.
void require_no_overlap(const py::array& a, const char* a_name, const py::array& b, const char* b_name);

template <class T, std::size_t N>
ArrayView<T, N> view_of(const py::array& array, std::remove_const_t<T>* data) {
    typename ArrayView<T, N>::extents_type extents{};
    typename ArrayView<T, N>::extents_type strides{};
    for (std::size_t d = 0; d < N; ++d) {
        extents[d] = array.shape(static_cast<py::ssize_t>(d));
        strides[d] = array.strides(static_cast<py::ssize_t>(d)) / static_cast<py::ssize_t>(sizeof(T));
    }
    return {data, extents, strides};
}

/// An input array and what keeps its memory alive. Take it by value in the binding, use `.view` once the GIL is released.
template <class T, std::size_t N>
struct Input {
    py::array owner;
    ArrayView<const T, N> view;
};

template <class T, std::size_t N>
Input<T, N> input(const py::object& object, const char* argument) {
    const py::array array = readable(require_array(object, argument, py::dtype::of<T>()), sizeof(T));
    if (static_cast<std::size_t>(array.ndim()) != N) throw_dimensions(argument, N, array);
    return {array, view_of<const T, N>(array, static_cast<T*>(const_cast<void*>(array.data())))};
}

/// Real-valued parameters (positions, ranges): any array-like of numbers is taken, as float64.
template <std::size_t N>
Input<double, N> real_input(const py::object& object, const char* argument) {
    py::object made;
    try {
        made = py::module_::import("numpy").attr("asarray")(object, py::dtype::of<double>());
    } catch (py::error_already_set& error) {
        if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
        throw py::type_error(std::string(argument) + ": expected an array of real numbers, got " +
                             py::str(py::type::of(object).attr("__name__")).cast<std::string>());
    }
    const py::array array = readable(made.cast<py::array>(), sizeof(double));
    if (static_cast<std::size_t>(array.ndim()) != N) throw_dimensions(argument, N, array);
    return {array, view_of<const double, N>(array, static_cast<double*>(const_cast<void*>(array.data())))};
}

template <class T, std::size_t N>
struct Output {
    py::array owner;
    ArrayView<T, N> view;
};

/// `out` checked (dtype, shape, writable, not overlapping `source`), or a new array where `out` is None.
template <class T, std::size_t N>
Output<T, N> output(const py::object& out, const std::array<std::ptrdiff_t, N>& extents, const py::array* source = nullptr) {
    py::array array;
    if (out.is_none()) {
        std::uint64_t bytes = sizeof(T);
        for (const std::ptrdiff_t e : extents) bytes *= static_cast<std::uint64_t>(e);
        require_memory(bytes, "the result");
        array = py::array_t<T>(std::vector<py::ssize_t>(extents.begin(), extents.end()));
    } else {
        array = require_array(out, "out", py::dtype::of<T>());
        if (static_cast<std::size_t>(array.ndim()) != N) throw_dimensions("out", N, array);
        require_writable(array, "out", sizeof(T));
        for (std::size_t d = 0; d < N; ++d)
            if (array.shape(static_cast<py::ssize_t>(d)) != extents[d]) {
                std::array<std::ptrdiff_t, N> actual{};
                for (std::size_t k = 0; k < N; ++k) actual[k] = array.shape(static_cast<py::ssize_t>(k));
                throw ShapeError("out", shape_text(extents), shape_text(actual));
            }
        if (source != nullptr) require_no_overlap(array, "out", *source, "the input");
    }
    return {array, view_of<T, N>(array, static_cast<T*>(array.mutable_data()))};
}

/// Hands an Array to NumPy without a copy.
template <class T, std::size_t N>
py::array_t<T> to_numpy(Array<T, N>&& array) {
    const std::vector<py::ssize_t> shape(array.extents().begin(), array.extents().end());
    if (array.empty()) return py::array_t<T>(shape);
    auto* owned = new Array<T, N>(std::move(array));
    const py::capsule owner(owned, [](void* p) { delete static_cast<Array<T, N>*>(p); });
    return py::array_t<T>(shape, owned->data(), owner);
}

template <class T>
py::array_t<T> to_numpy(const std::vector<T>& values) {
    return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// threads= and progress= of every function. The callback gets (phase, done, total) and may return False to stop; Ctrl-C is looked
/// for whether or not there is a callback.
Execution execution(int threads, const py::object& progress);

}  // namespace sarfocus::python

#include <exception>
#include <string>

#include <sarfocus/core/checks.hpp>
#include <sarfocus/core/error.hpp>
#include <sarfocus/core/execution.hpp>

#include "bindings.hpp"

namespace py = pybind11;

namespace sarfocus::python {

void bind_core(py::module_ m) {
    // The one table from C++ exceptions to Python ones; later registrations are tried first.
    static py::exception<NumericalError> numerical_error(m, "NumericalError", PyExc_ValueError);
    static py::exception<ShapeError> shape_error(m, "ShapeError", PyExc_ValueError);
    static py::exception<MemoryEstimateError> memory_error(m, "MemoryEstimateError", PyExc_MemoryError);
    static py::exception<Cancelled> cancelled(m, "Cancelled", PyExc_RuntimeError);
    py::register_exception_translator([](std::exception_ptr pending) {
        try {
            if (pending) std::rethrow_exception(pending);
        } catch (const ShapeError& e) {
            py::set_error(shape_error, e.what());
        } catch (const ValueError& e) {
            py::set_error(PyExc_ValueError, e.what());
        } catch (const NumericalError& e) {
            py::set_error(numerical_error, e.what());
        } catch (const MemoryEstimateError& e) {
            py::set_error(memory_error, e.what());
        } catch (const Cancelled& e) {
            py::set_error(cancelled, e.what());
        }
    });
    m.def("available_memory", &available_memory, "Memory the system could give out now, bytes; 0 where it does not tell.");
    m.def("thread_count", &resolve_threads, py::arg("threads") = 0, "Number of threads that threads= stands for.");
}

}  // namespace sarfocus::python

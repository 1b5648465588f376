#include "bindings.hpp"

namespace py = pybind11;

namespace sarfocus::python {

void bind_quality(py::module_ m) {
    (void)m;
}

}  // namespace sarfocus::python

#include "bindings.hpp"
#ifdef PANONAV_PYTHON_FLEET
#include "panonav_fleet/postgresql_memories.hpp"
#endif
#include "panonav_recordings/register_recordings.hpp"

namespace {
namespace py = pybind11;
}

PYBIND11_MODULE(_core, m) {
  using namespace panonav::python;
  m.doc() = "The panonav library (see the package panonav).";
  m.attr("__version__") = PANONAV_VERSION;
#ifdef PANONAV_PYTHON_FLEET
  panonav::fleet::register_postgresql_memories();
#endif
  panonav::recordings::register_recordings();
  bind_basics(m);
  bind_panoramas(m);
  bind_signatures(m);
  bind_memories(m);
  bind_recordings(m);
  bind_localisation(m);
  bind_homing(m);
  bind_mapping(m);
  bind_routes(m);
  bind_measures(m);
  bind_navigation(m);
  bind_calibration(m);
#ifdef PANONAV_PYTHON_SIMULATES
  bind_simulation(m);
#endif
  // People know these by the package's name.
  for (const auto& [name, value] : m.attr("__dict__").cast<py::dict>()) {
    if (py::hasattr(value, "__module__")) value.attr("__module__") = "panonav";
  }
}

#include <fmt/format.h>

#include "clrad/error.hpp"
#include "clrad/visibility.hpp"
#include "visibility/batch.hpp"
#include "visibility/chop.hpp"
#include "visibility/serial.hpp"
#include "visibility/shaft.hpp"

namespace clrad {

void check_segments(const Segments& s) {
  if (!s.origins || !s.targets) throw UsageError("visibility segments need origins and targets");
  if (s.active ? s.active->size() < s.origin_count : s.origins->size() < s.origin_count)
    throw UsageError("visibility segments name more origins than there are");
  if (s.targets->size() < (s.samples ? s.samples : s.active ? 0 : s.origin_count))
    throw UsageError("visibility segments name more targets than there are");
}

std::vector<std::string> engine_names() {
  return {"serial", "chop", "shaft"};
}

std::unique_ptr<VisibilityEngine> make_engine(const std::string& name, Device& device,
                                              std::span<const OccluderTriangle> triangles) {
  if (name == "serial") return make_serial(device, triangles);
  if (name == "chop") return make_chop(device, triangles);
  if (name == "shaft") return make_shaft(device, triangles);
  throw UsageError(fmt::format("there is no visibility engine \"{}\"; choose one of: {}", name,
                               fmt::join(engine_names(), ", ")));
}

}  // namespace clrad

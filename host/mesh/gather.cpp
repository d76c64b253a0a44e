#include "mesh/gather.hpp"

namespace clrad {

Gatherer::Gatherer(Device& device, const Mesh& mesh)
    : device_(device),
      patches_(std::uint32_t(mesh.patches.size())),
      elements_(std::uint32_t(mesh.elements.size())),
      vertex_(device, 4 * mesh.elements.size(), "element corners"),
      first_element_(device, mesh.patches.size() + 1, "patch segments"),
      weight_(device, 4 * mesh.elements.size(), "element weights"),
      share_(device, mesh.elements.size(), "element shares"),
      element_values_(device, mesh.elements.size(), "element values") {
  std::vector<std::uint32_t> vertex, first;
  std::vector<double> weight, share;
  for (const Element& e : mesh.elements) {
    vertex.insert(vertex.end(), e.vertex.begin(), e.vertex.end());
    weight.insert(weight.end(), e.weight.begin(), e.weight.end());
    share.push_back(e.area_m2 / mesh.patches[e.patch].area_m2);
  }
  for (const Patch& p : mesh.patches) first.push_back(p.first_element);
  first.push_back(elements_);
  vertex_.upload(vertex);
  first_element_.upload(first);
  weight_.upload(weight);
  share_.upload(share);
}

void Gatherer::gather(const RealArray& vertex_values, RealArray& patch_values, std::uint64_t at,
                      std::uint64_t from) {
  device_.run("mesh/gather.cl", "gather_elements", elements_, vertex_values, from, vertex_, weight_,
              element_values_, elements_);
  // Few patches of many elements would be one work-group, on one compute unit.
  device_.run_local("mesh/gather.cl", "gather_patches", patches_,
                    device_.options().shape == Shape::blocks ? 4 : 0, element_values_, share_, first_element_,
                    patch_values, at, patches_);
}

}  // namespace clrad

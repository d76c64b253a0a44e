#include "visibility/engine_tree.hpp"

#include "visibility/shaft.hpp"

namespace clrad {

EngineTree::EngineTree(Device& device, const VisibilityEngine& engine,
                       std::span<const OccluderTriangle> triangles) {
  if (const auto* shaft = dynamic_cast<const ShaftEngine*>(&engine)) {
    tree_ = &shaft->tree();
    return;
  }
  own_ = std::make_unique<Tree>(device, Occluders(device, triangles));
  tree_ = own_.get();
}

}  // namespace clrad

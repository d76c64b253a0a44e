/// The tree of occluders for those who ask more of it than an engine does.
#pragma once
#include <memory>
#include <span>

#include "visibility/tree.hpp"

namespace clrad {

/// The tree that `engine` walks, or where it has none, one of its own.
class EngineTree {
 public:
  EngineTree(Device& device, const VisibilityEngine& engine, std::span<const OccluderTriangle> triangles);
  const Tree& operator*() const { return *tree_; }

 private:
  std::unique_ptr<Tree> own_;
  const Tree* tree_;
};

}  // namespace clrad

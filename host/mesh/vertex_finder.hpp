// Vertices by their place in a polygon's lattice.
#pragma once
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "clrad/mesh.hpp"

namespace clrad {

/// The first mesh's by their number in its lattice, later ones by name. The mesh and `covered` have to outlive it.
class VertexFinder {
 public:
  static constexpr std::uint32_t none = 0xffffffffu;

  VertexFinder(const Mesh& mesh, const std::vector<std::uint8_t>& covered);

  /// In lattice coordinates. none: there is no such vertex, or something covers it.
  std::uint32_t at(std::uint32_t polygon, std::int64_t i, std::int64_t j) const {
    const std::uint32_t v = any_at(polygon, i, j);
    return v == none || covered_[v] ? none : v;
  }

 private:
  struct Place {
    std::uint32_t polygon, i, j;
    bool operator==(const Place&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Place& p) const {
      const std::uint64_t x = (std::uint64_t(p.i) << 32 | p.j) + p.polygon * 0x9e3779b97f4a7c15u;
      const std::uint64_t y = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
      return (y ^ y >> 27) * 0x94d049bb133111ebu >> 8;
    }
  };

  std::uint32_t any_at(std::uint32_t polygon, std::int64_t i, std::int64_t j) const;

  const Mesh& mesh_;
  const std::vector<std::uint8_t>& covered_;
  std::unordered_map<Place, std::uint32_t, Hash> later_;
};

}  // namespace clrad

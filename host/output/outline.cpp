#include "output/outline.hpp"

#include <algorithm>

namespace clrad {

Outline outline(const Element& element) {
  constexpr std::uint32_t no_vertex = 0xffffffffu;
  const std::size_t corners = element.vertex[3] == no_vertex ? 3 : 4;
  Outline chain;
  std::uint32_t first = 0;
  bool split = false;
  for (std::size_t k = 0; k < corners; ++k) {
    chain.vertex[chain.vertices++] = element.vertex[k];
    if (element.middle[k] == no_vertex) continue;
    if (!split) first = chain.vertices, split = true;
    chain.vertex[chain.vertices++] = element.middle[k];
  }
  std::rotate(chain.vertex.begin(), chain.vertex.begin() + first, chain.vertex.begin() + chain.vertices);
  return chain;
}

}  // namespace clrad

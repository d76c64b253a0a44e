#include "visibility/tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "clrad/primitives.hpp"

namespace clrad {
namespace {

constexpr const char* tree_kernels = "visibility/tree.cl";
constexpr std::uint32_t radius = 8, node_words = 12, cells = 1024, wide = 8,
                        wide_words = 64;  // as in the kernel file

/// All nodes of the tree as they are made, and how many there were after each round.
struct Clustering {
  Array<std::uint32_t> nodes;
  std::vector<std::uint32_t> made;  ///< nodes after each round; the triangles at first
};

Clustering cluster(Device& device, std::uint32_t n, const Array<std::uint32_t>& order,
                   const Array<float>& box, bool plain) {
  Clustering c{{device, std::uint64_t(node_words) * (2ull * n - 1), "nodes of the tree"}, {n}};
  const std::uint64_t floats = 6ull * (n + 2 * radius);
  Array<float> boxes(device, floats, "boxes of clusters"), next_boxes(device, floats, "boxes of clusters");
  Array<std::uint32_t> clusters(device, n, "clusters"), next_clusters(device, n, "clusters");
  Array<std::uint32_t> nearest(device, n, "nearest clusters"), stays(device, n, "pairs of clusters"),
      makes(device, n, "pairs of clusters"), position(device, n, "pairs of clusters"),
      made(device, n, "pairs of clusters");
  device.run(tree_kernels, "tree_start", n + 2ull * radius, n, order, box, c.nodes, boxes, clusters);
  for (std::uint32_t count = n; count > 1;) {
    device.run(tree_kernels, "tree_nearest", count, count, n, cl_uint(plain), boxes, nearest);
    device.run(tree_kernels, "tree_pair", count, count, nearest, stays, makes);
    const std::uint32_t left = scan_uint(device, Sum::exclusive, stays.buffer(), position.buffer(), count);
    const std::uint32_t pairs = scan_uint(device, Sum::exclusive, makes.buffer(), made.buffer(), count);
    device.run(tree_kernels, "tree_merge", count + 2ull * radius, count, n, c.made.back(), left, nearest,
               stays, makes, position, made, clusters, boxes, c.nodes, next_clusters, next_boxes);
    std::swap(clusters, next_clusters);
    std::swap(boxes, next_boxes);
    count = left;
    c.made.push_back(c.made.back() + pairs);
  }
  return c;
}

/// Nothing, or one triangle: a root of one leaf or none.
std::vector<std::uint32_t> lone_root(std::span<const float> box) {
  std::vector<std::uint32_t> words(wide_words);
  for (std::size_t k = 0; k < wide; ++k)
    for (std::size_t a = 0; a < 6; ++a)
      words[wide * a + k] = std::bit_cast<std::uint32_t>(k == 0 && !box.empty() ? box[a]
                                                         : a < 3                ? 1e18f
                                                                                : -1e18f);
  words[6 * wide] = box.empty() ? 0 : 1;
  return words;
}

/// Level by level, each wide node asks for one node per inner child.
Array<std::uint32_t> widen(Device& device, std::uint32_t n, std::uint32_t pairs, const Clustering& c,
                           const Array<std::uint32_t>& begin, std::uint32_t& total) {
  Array<std::uint32_t> nodes(device, std::uint64_t(wide_words) * pairs, "tree of occluders");
  std::vector<std::uint32_t> root{2 * n - 2};
  Array<std::uint32_t> level(device, root, "level of the tree");
  std::uint32_t first = 0, count = 1;
  while (count > 0) {
    Array<std::uint32_t> child(device, std::uint64_t(wide) * count, "level of the tree"),
        inner(device, count, "level of the tree"), offsets(device, count, "level of the tree");
    device.run(tree_kernels, "tree_widen", count, count, n, first, level, c.nodes, begin, nodes, child,
               inner);
    const std::uint32_t next = scan_uint(device, Sum::exclusive, inner.buffer(), offsets.buffer(), count);
    Array<std::uint32_t> next_level(device, std::max(next, 1u), "level of the tree");
    device.run(tree_kernels, "tree_link", count, count, first, first + count, child, offsets, nodes,
               next_level);
    level = std::move(next_level);
    first += count, count = next;
  }
  total = first;
  Array<std::uint32_t> kept(device, std::uint64_t(wide_words) * total, "tree of occluders");
  device.copy(nodes.buffer(), kept.buffer(), kept.bytes());
  return kept;
}

}  // namespace

Tree::Tree(Device& device, const Occluders& occluders, bool balanced) : count(occluders.count) {
  const auto stage = device.stage("build the tree of occluders");
  const std::uint32_t n = count;
  triangles = Array<clrad_triangle>(device, std::max(n, 1u), "triangles of the tree");
  facets = Array<clrad_facet>(device, std::max(n, 1u), "facets of the tree");
  input_index = Array<std::uint32_t>(device, std::max(n, 1u), "triangles of the tree");
  Array<std::uint32_t> order(device, std::max(n, 1u), "order of triangles");
  Array<float> box(device, 6ull * std::max(n, 1u), "boxes of triangles");
  inner = 1, depth = 1;
  if (n > 0) {
    Array<std::uint32_t> keys(device, n, "Morton codes"), values(device, n, "Morton order");
    const auto size = occluders.box_high - occluders.box_low;
    float per_cell[3];
    for (int a = 0; a < 3; ++a) per_cell[a] = float(cells / std::max(size[a], 0x1p-38));
    device.run(tree_kernels, "tree_leaves", n, occluders.triangles, n, float(occluders.box_low.x),
               float(occluders.box_low.y), float(occluders.box_low.z), per_cell[0], per_cell[1], per_cell[2],
               box, keys, values);
    radix_sort(device, keys.buffer(), values.buffer(), n, 30);
    if (n == 1) {
      order.fill_zero();
      nodes = Array<std::uint32_t>(device, lone_root(box.download()), "tree of occluders");
    } else {
      Clustering c = cluster(device, n, values, box, balanced);
      const auto root = [&] {
        return c.nodes.download(std::uint64_t(node_words) * (2ull * n - 2), node_words);
      };
      if (!balanced && root()[11] > most_depth) c = cluster(device, n, values, box, true);
      const std::vector<std::uint32_t> top = root();
      depth = top[11];
      float b[6];
      std::copy_n(reinterpret_cast<const float*>(top.data()), 6, b);
      const double dx = double(b[3]) - b[0], dy = double(b[4]) - b[1], dz = double(b[5]) - b[2];
      cost = std::bit_cast<float>(top[10]) / std::max(dx * dy + dy * dz + dz * dx, 1e-30);
      Array<std::uint32_t> begin(device, 2ull * n - 1, "places of nodes");
      device.fill_bytes(begin.buffer(), 0, 4, 4ull * (2ull * n - 2));
      for (std::size_t r = c.made.size(); --r > 0;)
        device.run(tree_kernels, "tree_begin", c.made[r] - c.made[r - 1], c.made[r - 1],
                   c.made[r] - c.made[r - 1], n, c.nodes, begin, order);
      nodes = widen(device, n, std::max(top[9], 1u), c, begin, inner);
    }
    device.run(tree_kernels, "tree_triangles", n, n, order, occluders.triangles, occluders.facets,
               occluders.input_index, triangles, facets, input_index);
  } else {
    nodes = Array<std::uint32_t>(device, lone_root({}), "tree of occluders");
  }
  device.finish();
}

}  // namespace clrad

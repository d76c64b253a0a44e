#include "solve/near_field.hpp"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "mesh/lattice.hpp"
#include "solve/near_balance.hpp"
#include "solve/nodes.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t most_bands = 16;  // CLRAD_MOST_BANDS of near_field.cl
// What a patch's average hides shows as far as some of its own sides (the outer half of this fades out): each further one takes off some
// 5 % of the error, and more time than the one before. Cells of this many levels below a patch show what is needed of it from there,
// however fine its elements are: work is receivers around a patch x its cells.
constexpr double reach_in_sides = 2;
constexpr std::uint32_t cell_level = 3;

// Pieces of patches: elements, or runs of elements that have one ancestor `cell_level` levels below their patch.
struct Cells {
  std::vector<double> shooters;   // shooter_record() of each
  std::vector<double> radiosity;  // [band][cell], of the exposed part; negative where everything is covered
  std::vector<double> slopes;     // [band][cell][3]: how it varies with s, t and s t from the cell's middle
  std::vector<std::uint32_t> first;  // of each patch, and the end
  std::uint32_t count() const { return first.back(); }
};

// The same for receivers that see no more of a cell than its middle: packets of 16 cells of one patch.
struct CellPackets {
  std::vector<double> rows;          // [packet][rows_of_packet][16], as CLRAD_CELL_* of near_field.cl say
  std::vector<double> radiosity;     // [band][packet][16]
  std::vector<std::uint32_t> first;  // packet of each patch, and the end
  std::uint32_t count() const { return first.back(); }
};
constexpr std::uint32_t packet_cells = 16, rows_of_packet = 8;

std::uint32_t ancestor(std::uint32_t code) {
  return code >> 2 * (lattice_depth - cell_level);
}

// Lattice coordinates of the corners of the ancestor of `e` at cell_level.
std::array<glm::dvec2, 4> cell_corners(const Mesh& mesh, const Element& e, std::uint32_t corners) {
  std::array<glm::dvec2, 4> c{};
  for (std::uint32_t k = 0; k < corners; ++k)
    c[k] = {mesh.lattice[e.vertex[k]][0], mesh.lattice[e.vertex[k]][1]};
  for (std::uint32_t level = e.level; level > cell_level; --level) {
    const std::uint32_t child = e.code >> 2 * (lattice_depth - level) & 3;
    const auto at = c;
    // A child keeps its parent's corner in its place and is half as large; a triangle's middle one is turned.
    for (std::uint32_t k = 0; k < corners; ++k)
      c[k] = corners == 3 && child == 3 ? at[(k + 1) % 3] + at[(k + 2) % 3] - at[k]
                                        : at[child] + 2.0 * (at[k] - at[child]);
  }
  return c;
}

void add_shooter(Cells& cells, const Solution& solution, const Element& first, double area_m2) {
  const Mesh& mesh = solution.mesh;
  const std::uint32_t p = mesh.patches[first.patch].polygon;
  const Polygon& polygon = solution.scene.polygons[p];
  const LatticeMap map(polygon, solution.frame, mesh.polygons[p].patches_u, mesh.polygons[p].patches_v);
  const auto corner = cell_corners(mesh, first, polygon.corners);
  Shooter shooter;
  shooter.corners = polygon.corners;
  for (std::uint32_t k = 0; k < polygon.corners; ++k)
    shooter.corner[k] = map.position(corner[k].x, corner[k].y);
  shooter.normal = polygon.normal();
  const double unit = solution.frame.metres();
  shooter.area = area_m2 / (unit * unit);
  shooter.plane = mesh.receivers[mesh.polygons[p].first_vertex].plane;
  const auto record = shooter_record(shooter);
  cells.shooters.insert(cells.shooters.end(), record.begin(), record.end());
}

// Corner vertices of an ancestor of elements `first` .. `end` - 1: corner k is that of the leaf whose path is k all the way.
std::array<std::uint32_t, 4> corner_vertices(const Mesh& mesh, std::uint32_t first, std::uint32_t end) {
  std::array<std::uint32_t, 4> vertices = mesh.elements[first].vertex;
  for (std::uint32_t e = first; e < end; ++e) {
    const Element& element = mesh.elements[e];
    if (element.level <= cell_level) continue;
    const std::uint32_t shift = 2 * (lattice_depth - element.level),
                        mask = (1u << 2 * (element.level - cell_level)) - 1;
    for (std::uint32_t k = 0; k < 4; ++k)
      if ((element.code >> shift & mask) == (0x55555555u * k & mask)) vertices[k] = element.vertex[k];
  }
  if (mesh.elements[first].vertex[3] == 0xffffffffu) vertices[3] = 0xffffffffu;
  return vertices;
}

// Of a bilinear (a triangle: linear) function by its values at the corners; all 0 where something covers one of these.
std::array<double, 3> corner_slopes(const Solution& solution, const std::array<std::uint32_t, 4>& vertex,
                                    std::uint32_t band, std::uint32_t polygon) {
  std::array<double, 4> value{};
  const bool triangle = vertex[3] == 0xffffffffu;
  for (std::uint32_t k = 0; k < (triangle ? 3 : 4); ++k) {
    if (solution.vertex_covered[vertex[k]]) return {};
    value[k] = solution.vertex_radiosity(band, vertex[k], polygon);
  }
  const auto& [a, b, c, d] = value;
  if (triangle) return {b - a, c - a, 0};
  return {(b + c - a - d) / 2, (c + d - a - b) / 2, a - b + c - d};
}

Cells make_cells(const Solution& solution, const std::vector<double>& node_values) {
  const Mesh& mesh = solution.mesh;
  const std::size_t patches = mesh.patches.size(), count = patches + mesh.elements.size();
  Cells cells;
  std::vector<std::vector<double>> radiosity(solution.bands), slopes(solution.bands);
  for (const Patch& patch : mesh.patches) {
    cells.first.push_back(std::uint32_t(radiosity[0].size()));
    for (std::uint32_t e = patch.first_element, end; e < patch.first_element + patch.elements; e = end) {
      double area = 0, seen_area = 0;
      std::vector<double> power(solution.bands, 0);
      const std::uint32_t of = ancestor(mesh.elements[e].code);
      for (end = e; end < patch.first_element + patch.elements && ancestor(mesh.elements[end].code) == of;
           ++end) {
        const Element& element = mesh.elements[end];
        double seen = 0;
        for (int k = 0; k < 4; ++k)
          if (element.vertex[k] != 0xffffffffu && !solution.vertex_covered[element.vertex[k]])
            seen += element.weight[k];
        area += element.area_m2;
        seen_area += seen * element.area_m2;
        for (std::uint32_t b = 0; b < solution.bands; ++b)
          power[b] += seen * element.area_m2 * node_values[b * count + patches + end];
      }
      add_shooter(cells, solution, mesh.elements[e], area);
      const auto corner = corner_vertices(mesh, e, end);
      for (std::uint32_t b = 0; b < solution.bands; ++b) {
        radiosity[b].push_back(seen_area > 0 ? power[b] / seen_area : -1);
        const auto slope = corner_slopes(solution, corner, b, patch.polygon);
        slopes[b].insert(slopes[b].end(), slope.begin(), slope.end());
      }
    }
  }
  cells.first.push_back(std::uint32_t(radiosity[0].size()));
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    cells.radiosity.insert(cells.radiosity.end(), radiosity[b].begin(), radiosity[b].end());
    cells.slopes.insert(cells.slopes.end(), slopes[b].begin(), slopes[b].end());
  }
  return cells;
}

CellPackets make_packets(const Cells& cells, std::uint32_t bands) {
  CellPackets packets;
  packets.first.push_back(0);
  for (std::size_t p = 0; p + 1 < cells.first.size(); ++p)
    packets.first.push_back(packets.first[p] +
                            (cells.first[p + 1] - cells.first[p] + packet_cells - 1) / packet_cells);
  packets.rows.assign(std::size_t(packets.count()) * rows_of_packet * packet_cells, 0);
  packets.radiosity.assign(std::size_t(bands) * packets.count() * packet_cells, 0);
  for (std::size_t p = 0; p + 1 < cells.first.size(); ++p)
    for (std::uint32_t e = cells.first[p]; e < cells.first[p + 1]; ++e) {
      const std::size_t packet = packets.first[p] + (e - cells.first[p]) / packet_cells,
                        lane = (e - cells.first[p]) % packet_cells;
      if (cells.radiosity[e] < 0) continue;  // covered
      // A shooter_record(): corners first, its normal at 40, its area at 46.
      const double* cell = cells.shooters.data() + std::size_t(e) * shooter_record_size;
      const bool triangle = std::equal(cell + 6, cell + 9, cell + 9);
      double* row = packets.rows.data() + packet * rows_of_packet * packet_cells + lane;
      for (std::size_t a = 0; a < 3; ++a) {
        const double sum = cell[a] + cell[3 + a] + cell[6 + a], across = cell[a] - cell[6 + a];
        row[a * packet_cells] = triangle ? sum / 3 : (sum + cell[9 + a]) / 4;
        row[(3 + a) * packet_cells] = cell[40 + a];
        row[7 * packet_cells] += across * across;
      }
      row[6 * packet_cells] = cell[46];
      for (std::uint32_t b = 0; b < bands; ++b)
        packets.radiosity[(std::size_t(b) * packets.count() + packet) * packet_cells + lane] =
            cells.radiosity[std::size_t(b) * cells.count() + e];
    }
  return packets;
}

void add_near(SolveState& state, const RealArray& near) {
  state.device.run("solve/near_balance.cl", "add_near", near.size(), near, state.vertex_irradiance,
                   std::uint32_t(near.size()));
}

}  // namespace

std::vector<double> patch_boxes(const Mesh& mesh) {
  std::vector<double> box;
  box.reserve(6 * mesh.patches.size());
  for (const Patch& patch : mesh.patches) {
    glm::dvec3 low = patch.corner[0], high = low;
    for (std::uint32_t k = 1; k < patch.corners; ++k)
      low = glm::min(low, patch.corner[k]), high = glm::max(high, patch.corner[k]);
    for (const glm::dvec3& c : {low, high}) box.insert(box.end(), {c.x, c.y, c.z});
  }
  return box;
}

std::vector<double> near_field_reaches(const Mesh& mesh) {
  std::vector<double> reach;
  reach.reserve(mesh.patches.size());
  for (const Patch& patch : mesh.patches) {
    double side = 0;
    for (std::uint32_t k = 0; k < patch.corners; ++k)
      side = std::max(side, glm::distance(patch.corner[k], patch.corner[(k + 1) % patch.corners]));
    reach.push_back(reach_in_sides * side);
  }
  return reach;
}

RealArray near_field(SolveState& state, const Solution& solution, std::uint32_t first_vertex,
                     NearBalance* balance) {
  const auto stage = state.device.stage("gather near patches by their elements");
  RealArray near(state.device, std::uint64_t(state.bands) * state.vertices, "near field");
  near.fill_zero();
  if (state.bands > most_bands) return near;
  const Mesh& mesh = state.mesh;
  const std::vector<double> node_values = node_radiosity(solution);
  const Cells cells = make_cells(solution, node_values);
  const auto patches = state.patches, elements = std::uint32_t(mesh.elements.size());
  std::vector<double> mean(std::size_t(state.bands) * patches);
  for (std::uint32_t b = 0; b < state.bands; ++b)
    std::copy_n(node_values.begin() + std::ptrdiff_t(b) * (patches + elements), patches,
                mean.begin() + std::ptrdiff_t(b) * patches);
  const RealArray radiosity_device(state.device, cells.radiosity, "cell radiosity");
  const RealArray slopes_device(state.device, cells.slopes, "slopes of cell radiosity");
  const RealArray mean_device(state.device, mean, "patch radiosity"),
      box_device(state.device, patch_boxes(mesh), "patch boxes");
  const RealArray shooters(state.device, cells.shooters, "cells");
  const CellPackets packets = make_packets(cells, state.bands);
  const RealArray packets_device(state.device, packets.rows, "packets of cells"),
      far_radiosity(state.device, packets.radiosity, "cell radiosity");
  // Where nobody asks for a patch's own gains they go where the next one's do.
  RealArray any_gains;
  Array<std::uint32_t> any_touched;
  if (!balance) {
    any_gains = RealArray(state.device, near.size(), "near field of a patch");
    any_touched = Array<std::uint32_t>(state.device, state.vertices / NearBalance::block() + 1,
                                       "near field of a patch");
    any_touched.fill_zero();  // the kernel's exchange reads what was there
  }
  RealArray& gains = balance ? balance->gains() : any_gains;
  Array<std::uint32_t>& touched = balance ? balance->touched() : any_touched;
  const std::vector<double> reaches = near_field_reaches(mesh);
  for (std::uint32_t slot = 0; slot < state.patch_of_slot.size(); ++slot) {
    const std::uint32_t patch = state.patch_of_slot[slot];
    const RealArray* column = state.vertex_columns[slot].get();
    if (!column)
      column = &trace_some(state, patch, first_vertex, [&](Array<std::uint32_t>& flags) {
        const std::uint32_t count = state.vertices - first_vertex;
        state.device.run("solve/near_field.cl", "keep_near", count, state.receivers, box_device, patch,
                         Real{reaches[patch]}, flags, first_vertex, count);
      });
    state.device.run("solve/near_field.cl", "near_field", state.vertices - first_vertex, state.receivers,
                     *column, state.colours, shooters, packets_device, packets.first[patch],
                     packets.first[patch + 1], cells.first[patch], radiosity_device, far_radiosity,
                     slopes_device, cells.count(), packets.count(), mean_device, state.total_shot, patch,
                     patches, box_device, Real{reaches[patch]}, near, gains, touched, NearBalance::block(),
                     NearBalance::stamp_of(slot), first_vertex, state.vertices, state.bands);
    if (balance) balance->take(slot);
  }
  return near;
}

void gather_near_field(SolveState& state, const Solution& solution) {
  if (!settles_near_field(state)) {
    add_near(state, near_field(state, solution));
    return;
  }
  NearBalance balance(state);
  const RealArray near = near_field(state, solution, 0, &balance);
  const auto stage = state.device.stage("gather near patches by their elements");
  add_near(state, near);
  balance.settle(near);
}

}  // namespace clrad

#include "scene/enclosure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <span>

#include "clrad/frame.hpp"
#include "scene/backs.hpp"
#include "scene/planes.hpp"
#include "scene/seams.hpp"
#include "scene/topology.hpp"

namespace clrad {
namespace {

using Index = std::uint32_t;

// Products of coordinates below 2 are rounded by at most 2^-52 each; sums of a few of them by less than this.
constexpr double undecided = 1e-14;

// Directions with coordinates that are no simple ratios.
const std::array<glm::dvec3, 4> directions = {glm::dvec3(0.3819660113, 0.5698402909, 0.7548776662),
                                              glm::dvec3(-0.7320508076, 0.4142135624, 0.5497004779),
                                              glm::dvec3(0.6180339887, -0.3247179572, 0.7071067812),
                                              glm::dvec3(0.2360679775, 0.8660254038, -0.4450418679)};

// A convex piece of surface, 3 or 4 corners.
struct Facet {
  std::array<glm::dvec3, 4> corner{};
  Index corners = 0;
  glm::dvec3 normal{0};
  int weight = 1;
  Index plane = 0;
};

std::vector<Facet> facets_of(const Scene& scene, const Frame& frame, std::span<const Index> planes,
                             const std::vector<Fill>& fills) {
  std::vector<Facet> facets;
  for (Index p = 0; p < scene.polygons.size(); ++p) {
    Facet f;
    f.corners = scene.polygons[p].corners;
    for (Index k = 0; k < f.corners; ++k) f.corner[k] = frame.to_frame(scene.polygons[p].corner[k]);
    f.normal = scene.polygons[p].normal();
    f.plane = planes[p];
    facets.push_back(f);
  }
  for (const Fill& fill : fills) {
    Facet f;
    f.corners = 3;
    std::copy(fill.corner.begin(), fill.corner.end(), f.corner.begin());
    const glm::dvec3 n = glm::cross(fill.corner[1] - fill.corner[0], fill.corner[2] - fill.corner[0]);
    const double length = glm::length(n);
    f.normal = n / length;
    f.weight = fill.weight;
    f.plane = fill.plane;
    facets.push_back(f);
  }
  return facets;
}

// Facets as seen along one direction, in square cells.
class View {
 public:
  View(const std::vector<Facet>& facets, const glm::dvec3& direction)
      : facets_(facets), forward_(glm::normalize(direction)) {
    right_ = glm::normalize(glm::cross(forward_, glm::dvec3(1, 0, 0)));
    up_ = glm::cross(forward_, right_);
    side_ = std::clamp<Index>(Index(std::sqrt(double(facets.size()))), 1, 1024);
    cells_.resize(std::size_t(side_) * side_);
    for (Index i = 0; i < facets.size(); ++i) {
      Outline o;
      for (Index k = 0; k < facets[i].corners; ++k) {
        o.corner[k] = flat(facets[i].corner[k]);
        o.low = glm::min(o.low, o.corner[k]), o.high = glm::max(o.high, o.corner[k]);
      }
      o.low -= beside, o.high += beside;
      for (Index y = cell(o.low.y); y <= cell(o.high.y); ++y)
        for (Index x = cell(o.low.x); x <= cell(o.high.x); ++x)
          cells_[std::size_t(y) * side_ + x].push_back(i);
      outlines_.push_back(o);
    }
  }

  // Facets that may lie above or below `p`, or have it in them.
  std::span<const Index> in_line_with(const glm::dvec3& p) const { return cell_of(flat(p)); }

  // Winding number beside `p` on the side that `normal` points to; facets in `plane`, which p lies in, are not counted.
  // Nothing when the ray passes something too closely.
  std::optional<int> winding(const glm::dvec3& p, const glm::dvec3& normal, Index plane) const {
    const glm::dvec2 at = flat(p);
    const double along = glm::dot(forward_, normal);
    if (std::abs(along) < 1e-6) return std::nullopt;
    const double way = along > 0 ? 1 : -1;
    int sum = 0;
    for (const Index i : cell_of(at)) {
      const Facet& f = facets_[i];
      const Outline& o = outlines_[i];
      if (f.plane == plane || at.x < o.low.x || at.y < o.low.y || at.x > o.high.x || at.y > o.high.y)
        continue;
      const double slope = glm::dot(forward_, f.normal);
      bool left = true, right = true, close = false;
      glm::dvec2 a = o.corner[f.corners - 1] - at;
      for (Index k = 0; k < f.corners; ++k) {
        const glm::dvec2 b = o.corner[k] - at;
        const double turn = a.x * b.y - a.y * b.x;
        close |= std::abs(turn) <= undecided;
        left &= turn > -undecided, right &= turn < undecided;
        a = b;
      }
      if (!left && !right) continue;
      if (close) return std::nullopt;
      const double height = glm::dot(f.corner[0] - p, f.normal);
      if (std::abs(height) <= undecided || std::abs(slope) < 1e-12) return std::nullopt;
      if (way * height / slope > 0) sum -= f.weight * (way * slope > 0 ? 1 : -1);
    }
    return sum;
  }

 private:
  glm::dvec2 flat(const glm::dvec3& p) const { return {glm::dot(p, right_), glm::dot(p, up_)}; }
  Index cell(double x) const {  // the frame is in a ball of radius sqrt(3)
    return Index(std::clamp((x + 1.8) / 3.6, 0.0, 0.999999) * side_);
  }
  std::span<const Index> cell_of(const glm::dvec2& at) const {
    return cells_[std::size_t(cell(at.y)) * side_ + cell(at.x)];
  }

  // A facet as it is seen, and a box that what is farther off than rounding is not in.
  struct Outline {
    std::array<glm::dvec2, 4> corner{};
    glm::dvec2 low{INFINITY}, high{-INFINITY};
  };
  static constexpr double beside = 1e-12;
  const std::vector<Facet>& facets_;
  std::vector<Outline> outlines_;
  glm::dvec3 forward_, right_, up_;
  Index side_ = 1;
  std::vector<std::vector<Index>> cells_;
};

bool contains(std::span<const glm::dvec3> corner, const glm::dvec3& normal, const glm::dvec3& p) {
  for (std::size_t k = 0; k < corner.size(); ++k)
    if (glm::dot(glm::cross(corner[(k + 1) % corner.size()] - corner[k], p - corner[k]), normal) < 0)
      return false;
  return true;
}

// The middle, off centre so that it is in line with nothing, and a point next to each corner.
std::vector<glm::dvec3> samples_of(const Facet& f) {
  constexpr std::array<double, 4> weight = {0.3090169944, 0.2679491924, 0.2332558, 0.1897780132};
  glm::dvec3 middle(0);
  double all = 0;
  for (Index k = 0; k < f.corners; ++k) middle += weight[k] * f.corner[k], all += weight[k];
  middle /= all;
  std::vector<glm::dvec3> samples{middle};
  for (Index k = 0; k < f.corners; ++k) samples.push_back(f.corner[k] + 1.1e-3 * (middle - f.corner[k]));
  return samples;
}

class Prover {
 public:
  // `planes`: of the polygons of `scene`.
  Prover(const Scene& scene, const Frame& frame, std::vector<Index> planes)
      : scene_(scene), frame_(frame), planes_(std::move(planes)), seams_(find_seams(scene, frame_, planes_)) {
    if (!seams_.open.empty()) return;
    facets_ = facets_of(scene_, frame_, planes_, seams_.fills);
  }

  // Besides the polygons there are `sheets`, both sides of which count as fronts; theirs are the planes `sheet_planes`.
  Enclosure prove(const std::vector<Polygon>& sheets, const std::vector<Index>& sheet_planes) {
    Enclosure walls = prove_walls();
    if (!walls.closed || sheets.empty()) return walls;
    // A ray that ends on a sheet ends on a front. Rays from a sheet have to start in the enclosed space, or carry nothing:
    // where no wall lets light out, nothing but its own emission leaves from a sheet outside.
    Scene only;
    only.polygons = sheets;
    const std::vector<Facet> facets = facets_of(only, frame_, sheet_planes, {});
    for (std::size_t s = 0; s < sheets.size(); ++s) {
      if (!emits(sheets[s])) continue;
      for (const glm::dvec3& at : samples_of(facets[s])) {
        const std::optional<int> w = winding(at, facets[s]);
        if (!w || *w != 1)
          return {false, fmt::format("\"{}\" at {} emits out of the enclosed space", sheets[s].name,
                                     sheets[s].where.text())};
      }
    }
    return walls;
  }

 private:
  bool emits(const Polygon& p) const {
    const auto& exitance = scene_.materials[p.material].emitted_exitance;
    return std::any_of(exitance.begin(), exitance.end(), [](double e) { return e > 0; });
  }

  Enclosure prove_walls() {
    if (!seams_.open.empty()) return {false, seams_.open};
    std::vector<bool> inside(seams_.surfaces, false);
    for (Index p = 0; p < scene_.polygons.size(); ++p)
      for (const glm::dvec3& at : samples_of(facets_[p])) {
        const std::optional<int> w = winding(at, facets_[p]);
        if (!w) return {false, fmt::format("no ray from {} is clear of all edges", name(p))};
        if (*w == 1) inside[seams_.surface[p]] = true;
        if (*w == 1 || (*w == 0 && covered(p, at))) continue;
        return {false, *w > 1 ? fmt::format("what {} faces is closed off from the room around it", name(p))
                              : fmt::format("{} faces out of the enclosed space", name(p))};
      }
    for (Index p = 0; p < scene_.polygons.size(); ++p)
      if (!inside[seams_.surface[p]]) return {false, fmt::format("{} is covered all over", name(p))};
    return {true, ""};
  }

  std::string name(Index p) const {
    return fmt::format("\"{}\" at {}", scene_.polygons[p].name, scene_.polygons[p].where.text());
  }

  const View& view(std::size_t d) {
    if (!views_[d]) views_[d] = std::make_unique<View>(facets_, directions[d]);
    return *views_[d];
  }

  std::optional<int> winding(const glm::dvec3& at, const Facet& facet) {
    for (std::size_t d = 0; d < directions.size(); ++d)
      if (const auto w = view(d).winding(at, facet.normal, facet.plane)) return w;
    return std::nullopt;
  }

  // By a polygon of another surface that faces it in the same plane, or by what stands on it.
  bool covered(Index p, const glm::dvec3& at) {
    int fills = 0;
    for (const Index i : view(0).in_line_with(at)) {
      const Facet& f = facets_[i];
      if (f.plane != planes_[p] || surface_of(i) == seams_.surface[p] ||
          !contains(std::span(f.corner).first(f.corners), f.normal, at))
        continue;
      const bool facing = glm::dot(f.normal, facets_[p].normal) < 0;
      if (i >= scene_.polygons.size())
        fills += facing ? f.weight : -f.weight;
      else if (facing)
        return true;
    }
    return fills > 0;
  }

  Index surface_of(Index facet) const {
    const std::size_t polygons = scene_.polygons.size();
    return facet < polygons ? seams_.surface[facet] : seams_.fills[facet - polygons].surface;
  }

  const Scene& scene_;
  Frame frame_;
  std::vector<Index> planes_;
  Seams seams_;
  std::vector<Facet> facets_;
  std::array<std::unique_ptr<View>, 4> views_;
};

}  // namespace

Enclosure find_enclosure(const Scene& scene) {
  if (scene.polygons.empty()) return {false, "there is nothing in the scene"};
  const Frame frame = frame_of(scene);
  std::vector<Index> planes = plane_ids(scene);
  if (std::none_of(scene.polygons.begin(), scene.polygons.end(), [](const Polygon& p) { return p.back; }))
    return Prover(scene, frame, std::move(planes)).prove({}, {});
  // Two-sided polygons of a closed surface are walls with their fronts; of others, both sides are sheets. The backs of
  // walls are outside, and sheets there.
  const std::vector<Index> surface = closed_surfaces(scene);
  Scene walls;
  walls.materials = scene.materials;
  std::vector<Polygon> sheets;
  std::vector<Index> wall_planes, sheet_planes;
  for (Index p = 0; p < scene.polygons.size(); ++p) {
    const bool is_sheet = scene.polygons[p].back || (has_back(scene, p) && surface[p] == 0xffffffffu);
    (is_sheet ? sheets : walls.polygons).push_back(scene.polygons[p]);
    (is_sheet ? sheet_planes : wall_planes).push_back(planes[p]);
  }
  if (walls.polygons.empty()) return {false, "there are only two-sided sheets in the scene"};
  return Prover(walls, frame, std::move(wall_planes)).prove(sheets, sheet_planes);
}

}  // namespace clrad

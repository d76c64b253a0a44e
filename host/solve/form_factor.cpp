#include "solve/form_factor.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "clrad/primitives.hpp"
#include "solve/transmission.hpp"

namespace clrad {
namespace {

constexpr const char* form_factor_kernels = "solve/form_factor.cl";

RealArray on_device(Device& device, const Shooter& shooter) {
  return RealArray(device, shooter_record(shooter), "shooter");
}

// A work-item of these kernels takes a packet of receivers, so a work-group is that much smaller.
template <class... Args>
void run_packets(Device& device, const char* kernel, std::uint32_t count, const Args&... args) {
  const unsigned width = device.options().packet_width;
  device.run_local(form_factor_kernels, kernel, (std::uint64_t(count) + width - 1) / width,
                   std::max(1u, device.options().work_group_size / width), args...);
}

// The receivers' list as a kernel argument; any buffer stands in for it where there is none.
const cl::Buffer& list_of(const Array<std::uint32_t>* active, const PointArray& receivers) {
  return active ? active->buffer() : receivers.buffer();
}

double disk_area(Estimator estimator, const Shooter& shooter, std::uint32_t n) {
  return estimator == Estimator::disk ? shooter.area : shooter.area / n;
}

// Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators": one step of SplitMix64.
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// Number `index` of the stream `seed`, in (0, 1).
double random_at(std::uint64_t seed, std::uint64_t index) {
  return (double(mixed(mixed(seed) + index) >> 12) + 0.5) * 0x1p-52;
}

// x in [0, 1] below which the share s of a density lies that goes linearly from f0 to f1.
double quantile_of_linear(double f0, double f1, double s) {
  const double below = f0 + std::sqrt(std::max(0.0, f0 * f0 + s * (f1 * f1 - f0 * f0)));
  return below > 0 ? std::min(1.0, s * (f0 + f1) / below) : s;
}

std::uint64_t morton(std::uint32_t column, std::uint32_t row) {
  std::uint64_t code = 0;
  for (unsigned bit = 0; bit < 32; ++bit)
    code |=
        (std::uint64_t(column >> bit & 1) << (2 * bit)) | (std::uint64_t(row >> bit & 1) << (2 * bit + 1));
  return code;
}

// n points of the unit square, stratified, in Morton order. wide: more columns than rows.
std::vector<std::array<double, 2>> unit_samples(std::uint32_t n, std::uint64_t seed, bool wide) {
  std::uint32_t rows = std::uint32_t(std::sqrt(double(n)));
  while (n % rows) --rows;
  std::uint32_t columns = n / rows;
  const bool on_grid = columns <= 3 * rows;
  if (!wide) std::swap(rows, columns);
  std::vector<std::pair<std::uint64_t, std::array<double, 2>>> keyed(n);
  for (std::uint32_t k = 0; k < n; ++k) {
    double u, v;
    if (on_grid) {
      u = (k % columns + random_at(seed, 2 * k)) / columns;
      const std::uint32_t row = k / columns;
      v = (row + random_at(seed, 2 * k + 1)) / rows;
      keyed[k].first = morton(k % columns, row);
    } else {
      u = random_at(seed, 0) + (k + 1) * 0.75487766624669276,
      v = random_at(seed, 1) + (k + 1) * 0.56984029099805327;
      u -= std::floor(u), v -= std::floor(v);
      keyed[k].first = morton(std::uint32_t(u * 65536), std::uint32_t(v * 65536));
    }
    keyed[k].second = {u, v};
  }
  std::stable_sort(keyed.begin(), keyed.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::array<double, 2>> result(n);
  for (std::uint32_t k = 0; k < n; ++k) result[k] = keyed[k].second;
  return result;
}

// The shooter as the bilinear image of the unit square: a triangle's last corner is repeated.
struct Bilinear {
  glm::dvec3 corner[4];
  glm::dvec3 normal;   // unit, by the right-hand rule
  double jacobian[4];  // area per parameter area at the corners; linear in between

  explicit Bilinear(const Shooter& shooter) {
    for (std::uint32_t k = 0; k < 4; ++k) corner[k] = shooter.corner[std::min(k, shooter.corners - 1)];
    normal = glm::cross(corner[2] - corner[0], corner[3] - corner[1]);
    const double length = glm::length(normal);
    normal = length > 0 ? normal / length : shooter.normal;
    const glm::dvec3 e01 = corner[1] - corner[0], e12 = corner[2] - corner[1];
    const glm::dvec3 e32 = corner[2] - corner[3], e03 = corner[3] - corner[0];
    jacobian[0] = glm::dot(normal, glm::cross(e01, e03));
    jacobian[1] = glm::dot(normal, glm::cross(e01, e12));
    jacobian[2] = glm::dot(normal, glm::cross(e32, e12));
    jacobian[3] = glm::dot(normal, glm::cross(e32, e03));
  }
  glm::dvec3 at(double u, double v) const {
    return (corner[0] * (1 - u) + corner[1] * u) * (1 - v) + (corner[3] * (1 - u) + corner[2] * u) * v;
  }
};

}  // namespace

std::array<double, shooter_record_size> shooter_record(const Shooter& shooter) {
  const Bilinear map(shooter);
  std::array<double, shooter_record_size> record{};
  double longest2 = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec3 edge = map.corner[(k + 1) % 4] - map.corner[k];
    // hi is a float in double precision, too: hi + lo is exact there as well.
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = map.corner[k][int(axis)], hi = double(float(x));
      record[3 * k + axis] = hi;
      record[12 + 3 * k + axis] = x - hi;
      record[24 + 3 * k + axis] = edge[int(axis)];
    }
    record[36 + k] = glm::dot(edge, edge);
    record[47 + k] = map.jacobian[k];
    longest2 = std::max(longest2, record[36 + k]);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double x = map.normal[int(axis)], hi = double(float(x));
    record[40 + axis] = hi;
    record[43 + axis] = x - hi;
  }
  record[46] = shooter.area;
  record[51] = 9 * longest2;
  return record;
}

std::vector<Point> stratified_samples(const Shooter& shooter, std::uint32_t n, std::uint64_t seed) {
  if (n == 0) return {};
  const Bilinear map(shooter);
  const double* j = map.jacobian;
  const bool wide = glm::length(map.corner[1] - map.corner[0]) >= glm::length(map.corner[3] - map.corner[0]);
  std::vector<Point> points;
  points.reserve(n);
  for (const auto& [s, t] : unit_samples(n, seed, wide)) {
    const double u = quantile_of_linear(j[0] + j[3], j[1] + j[2], s);
    const double v = quantile_of_linear(j[0] * (1 - u) + j[1] * u, j[3] * (1 - u) + j[2] * u, t);
    points.push_back({map.at(u, v), shooter.normal, shooter.plane, 0xffffffffu});
  }
  return points;
}

void facing(Device& device, const Shooter& shooter, const PointArray& receivers, std::uint32_t first,
            std::uint32_t count, Array<std::uint32_t>& flags) {
  run_packets(device, "facing", count, on_device(device, shooter), shooter.plane, receivers, flags, first,
              count);
}

namespace {

void launch_factors(Device& device, Estimator estimator, const Shooter& shooter, const PointArray& receivers,
                    const Array<std::uint32_t>* active, std::uint32_t count, const PointArray* samples,
                    std::uint32_t n, RealArray& factors, std::uint32_t dense) {
  const RealArray record = on_device(device, shooter);
  const std::uint32_t chosen = active != nullptr;
  if (estimator == Estimator::exact)
    run_packets(device, "exact_factors", count, record, shooter.plane, receivers, list_of(active, receivers),
                chosen, factors, dense, count);
  else
    device.run(form_factor_kernels, "disk_factors", count, record, shooter.plane, receivers,
               list_of(active, receivers), chosen, *samples, n, Real{disk_area(estimator, shooter, n)},
               receivers, 0u, 0u, receivers, std::uint64_t(0), factors, std::uint64_t(0), dense, 0u, count);
}

}  // namespace

void form_factors(Device& device, Estimator estimator, const Shooter& shooter, const PointArray& receivers,
                  const Array<std::uint32_t>* active, std::uint32_t count, const PointArray& samples,
                  std::uint32_t n, RealArray& factors) {
  launch_factors(device, estimator, shooter, receivers, active, count, &samples, n, factors, 0);
}

void unoccluded_factors(Device& device, Estimator estimator, const Shooter& shooter,
                        const PointArray& receivers, const Array<std::uint32_t>& active, std::uint32_t count,
                        const PointArray* samples, std::uint32_t n, RealArray& column) {
  launch_factors(device, estimator, shooter, receivers, &active, count, samples, n, column, 1);
}

void visible_factors(Device& device, Estimator estimator, const Shooter& shooter, const PointArray& receivers,
                     const Array<std::uint32_t>* active, std::uint32_t count, const PointArray& samples,
                     std::uint32_t n, const Array<std::uint32_t>& masks, const RealArray& factors,
                     RealArray& column, const Glass* glass, Array<std::uint32_t>& undecided) {
  if (count == 0) return;
  const RealArray record = on_device(device, shooter);
  const cl::Buffer& list = list_of(active, receivers);
  const std::uint32_t chosen = active != nullptr, colours = glass ? glass->colours() : 1;
  const std::uint64_t stride = column.size() / colours;
  const bool exact = estimator == Estimator::exact;
  // Of receivers first .. end - 1 in one colour. Without glass nothing reads `passes`.
  const auto weigh = [&](const RealArray& passes, std::uint64_t passes_at, std::uint32_t colour,
                         std::uint32_t first, std::uint32_t end) {
    const std::uint32_t by_glass = glass != nullptr;
    if (exact)
      run_packets(device, "visible_factors", end - first, record, receivers, list, chosen, samples, n, masks,
                  factors, by_glass, passes, passes_at, column, colour * stride, undecided, first, end);
    else
      device.run(form_factor_kernels, "disk_factors", end - first, record, shooter.plane, receivers, list,
                 chosen, samples, n, Real{disk_area(estimator, shooter, n)}, masks, 1u, by_glass, passes,
                 passes_at, column, colour * stride, 1u, first, end);
  };
  if (!exact) device.fill_bytes(undecided.buffer(), 0, std::uint64_t(count) * 4);
  if (!glass) return weigh(factors, 0, 0, 0, count);
  const Segments rays{&receivers, active, count, &samples, n};
  glass->pass(rays, masks, [&](const RealArray& passes, std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t c = 0; c < colours; ++c)
      weigh(passes, std::uint64_t(c) * (end - first) * n, c, first, end);
  });
}

void decide_undecided(Device& device, VisibilityEngine& engine, const Shooter& shooter,
                      const PointArray& receivers, const Array<std::uint32_t>* active,
                      const Array<std::uint32_t>& undecided, std::uint32_t late, const RealArray& factors,
                      RealArray& column, const Glass* glass) {
  if (late == 0) return;
  const RealArray record = on_device(device, shooter);
  const cl::Buffer& list = list_of(active, receivers);
  const std::uint32_t chosen = active != nullptr, colours = glass ? glass->colours() : 1;
  const std::uint64_t stride = column.size() / colours;
  PointArray origins(device, late, "undecided receivers"), ends(device, late, "undecided receivers");
  Array<std::uint32_t> late_masks(device, late, "undecided receivers");
  device.run(form_factor_kernels, "aim_undecided", late, record, shooter.plane, receivers, list, chosen,
             undecided, origins, ends, late);
  const Segments rays{&origins, nullptr, late, &ends, 0};
  engine.occluded(rays, late_masks);
  const RealArray passes = glass ? glass->pass_pairs(rays, late_masks) : RealArray();
  for (std::uint32_t c = 0; c < colours; ++c)
    device.run(form_factor_kernels, "decide", late, list, chosen, undecided, late_masks, factors,
               std::uint32_t(glass != nullptr), glass ? passes : factors, std::uint64_t(c) * late, column,
               c * stride, late);
}

void visible_factors(Device& device, VisibilityEngine& engine, Estimator estimator, const Shooter& shooter,
                     const PointArray& receivers, const Array<std::uint32_t>* active, std::uint32_t count,
                     const PointArray& samples, std::uint32_t n, const Array<std::uint32_t>& masks,
                     const RealArray& factors, RealArray& column, const Glass* glass) {
  if (count == 0) return;
  Array<std::uint32_t> flags(device, count, "undecided receivers"),
      undecided(device, count, "undecided receivers");
  visible_factors(device, estimator, shooter, receivers, active, count, samples, n, masks, factors, column,
                  glass, flags);
  if (estimator != Estimator::exact) return;
  const std::uint32_t late = compact(device, flags.buffer(), count, undecided.buffer());
  decide_undecided(device, engine, shooter, receivers, active, undecided, late, factors, column, glass);
}

}  // namespace clrad

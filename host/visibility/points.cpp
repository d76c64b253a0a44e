#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <glm/common.hpp>

#include "clrad/visibility.hpp"
#include "device/layout.hpp"

namespace clrad {
namespace {

bool is_double(const Device& device) {
  return device.options().precision == Precision::float64;
}

// Snapped coordinates of the exact predicate have 41 bits: 2^40 grid cells of 2^-38 either way.
constexpr double farthest = 4.0;

template <class DevicePoint>
DevicePoint to_device(const Point& p) {
  using Real = decltype(DevicePoint::x);
  DevicePoint d{};
  const Real x = Real(p.position.x), y = Real(p.position.y), z = Real(p.position.z);
  d.x = x, d.y = y, d.z = z;
  d.x_lo = Real(p.position.x - double(x));
  d.y_lo = Real(p.position.y - double(y));
  d.z_lo = Real(p.position.z - double(z));
  d.nx = Real(p.normal.x), d.ny = Real(p.normal.y), d.nz = Real(p.normal.z);
  d.plane = p.plane, d.surface = p.surface;
  return d;
}

template <class DevicePoint>
std::vector<std::byte> bytes_as(std::span<const Point> points) {
  std::vector<std::byte> bytes(points.size() * sizeof(DevicePoint));
  std::byte* to = bytes.data();
  for (const auto& p : points) {
    // Each by itself, and written so that NaN fails: std::max would drop one.
    const glm::dvec3 size = glm::abs(p.position);
    if (!(size.x <= farthest && size.y <= farthest && size.z <= farthest))
      throw UsageError(
          fmt::format("a point at ({:.6g}, {:.6g}, {:.6g}) of the scene's frame is farther out than {} times "
                      "the scene's size",
                      p.position.x, p.position.y, p.position.z, farthest / 2));
    const auto d = to_device<DevicePoint>(p);
    std::memcpy(to, &d, sizeof d);
    to += sizeof d;
  }
  return bytes;
}

// As the device has them.
std::vector<std::byte> bytes_of(const Device& device, std::span<const Point> points) {
  return is_double(device) ? bytes_as<clrad_point_double>(points) : bytes_as<clrad_point_float>(points);
}

std::uint64_t point_bytes(const Device& device) {
  return is_double(device) ? sizeof(clrad_point_double) : sizeof(clrad_point_float);
}

template <class DevicePoint>
std::vector<Point> download_as(Device& device, const cl::Buffer& buffer, std::uint64_t count) {
  std::vector<DevicePoint> raw(count);
  device.read(buffer, 0, count * sizeof(DevicePoint), raw.data());
  std::vector<Point> points;
  points.reserve(count);
  for (const auto& d : raw)
    points.push_back({{double(d.x) + d.x_lo, double(d.y) + d.y_lo, double(d.z) + d.z_lo},
                      {d.nx, d.ny, d.nz},
                      d.plane,
                      d.surface});
  return points;
}

}  // namespace

PointArray::PointArray(Device& device, std::uint64_t count, std::string_view what)
    : RawArray(device, count * point_bytes(device), what), count_(count) {}

PointArray::PointArray(Device& device, std::span<const Point> points, std::string_view what)
    : RawArray(device, points.size() * point_bytes(device), what, bytes_of(device, points).data()),
      count_(points.size()) {}

void PointArray::upload(std::span<const Point> points, std::uint64_t at) {
  const auto bytes = bytes_of(*device_, points);
  device_->write(buffer_, at * point_bytes(*device_), bytes.size(), bytes.data());
}

std::vector<Point> PointArray::download() const {
  return is_double(*device_) ? download_as<clrad_point_double>(*device_, buffer_, count_)
                             : download_as<clrad_point_float>(*device_, buffer_, count_);
}

}  // namespace clrad

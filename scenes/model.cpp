#include "model.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>

namespace make_scene {
namespace {

void save(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written");
}

std::string length(double metres) {
  std::string text = fmt::format("{:.9f}", metres);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string file_name(const std::string& path) {
  return path.substr(path.find_last_of("/\\") + 1);
}

}  // namespace

Turn turned(double t) {
  return {(1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)};
}

std::uint64_t Random::next() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

double Random::between(double low, double high) {
  return low + (high - low) * std::ldexp(static_cast<double>(next() >> 11), -53);
}

std::uint32_t Model::material(const MaterialText& text) {
  materials_.push_back(text);
  return static_cast<std::uint32_t>(materials_.size() - 1);
}

std::uint32_t Model::vertex(const Point& p) {
  vertices_.push_back(p);
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

void Model::face(std::initializer_list<std::uint32_t> corners, std::uint32_t material) {
  Face face{{},
            static_cast<std::uint32_t>(corners.size()),
            material,
            static_cast<std::uint32_t>(objects_.size() - 1)};
  std::copy(corners.begin(), corners.end(), face.vertex.begin());
  faces_.push_back(face);
}

std::size_t Model::triangles() const {
  std::size_t count = 0;
  for (const Face& f : faces_) count += f.corners - 2;
  return count;
}

void Model::room(const Point& size, std::uint32_t floor, std::uint32_t walls, std::uint32_t ceiling,
                 int split) {
  std::array<std::uint32_t, 8> v{};  // bits of the index: x, y, z
  for (std::uint32_t i = 0; i < 8; ++i) {
    v[i] = vertex({i & 1 ? size.x : 0, i & 2 ? size.y : 0, i & 4 ? size.z : 0});
  }
  const auto side = [&](const char* name, std::array<std::uint32_t, 4> q, std::uint32_t m) {
    object(name);
    if (split-- > 0) {
      face({v[q[0]], v[q[1]], v[q[2]]}, m);
      face({v[q[0]], v[q[2]], v[q[3]]}, m);
    } else {
      face({v[q[0]], v[q[1]], v[q[2]], v[q[3]]}, m);
    }
  };
  side("floor", {0, 1, 3, 2}, floor);
  side("wall_south", {0, 4, 5, 1}, walls);
  side("wall_north", {2, 3, 7, 6}, walls);
  side("wall_west", {0, 2, 6, 4}, walls);
  side("wall_east", {1, 5, 7, 3}, walls);
  side("ceiling", {4, 6, 7, 5}, ceiling);
}

void Model::box(const std::string& name, const Point& middle, const Point& size, std::uint32_t material,
                std::uint32_t bottom, const Turn& turn) {
  object(name);
  std::array<std::uint32_t, 8> v{};
  for (std::uint32_t i = 0; i < 8; ++i) {
    const double x = (i & 1 ? 0.5 : -0.5) * size.x, y = (i & 2 ? 0.5 : -0.5) * size.y;
    v[i] = vertex({middle.x + turn.cosine * x - turn.sine * y, middle.y + turn.sine * x + turn.cosine * y,
                   middle.z + (i & 4 ? size.z : 0)});
  }
  face({v[0], v[2], v[3], v[1]}, bottom);
  face({v[0], v[1], v[5], v[4]}, material);
  face({v[2], v[6], v[7], v[3]}, material);
  face({v[0], v[4], v[6], v[2]}, material);
  face({v[1], v[3], v[7], v[5]}, material);
  face({v[4], v[5], v[7], v[6]}, material);
}

void Model::lathe(const std::string& name, const Point& foot, const std::vector<Ring>& rings, int sides,
                  std::uint32_t material) {
  object(name);
  const auto n = static_cast<std::uint32_t>(sides);
  const auto first = static_cast<std::uint32_t>(vertices_.size());
  for (const Ring& ring : rings) {
    for (int s = 0; s < sides; ++s) {
      const double angle = 2 * std::numbers::pi * s / sides;
      vertex({foot.x + ring.radius * std::cos(angle), foot.y + ring.radius * std::sin(angle),
              foot.z + ring.height});
    }
  }
  const std::uint32_t below = vertex({foot.x, foot.y, foot.z + rings.front().height});
  const std::uint32_t above = vertex({foot.x, foot.y, foot.z + rings.back().height});
  const auto last = first + static_cast<std::uint32_t>(rings.size() - 1) * n;
  for (std::uint32_t s = 0; s < n; ++s) {
    const std::uint32_t next = (s + 1) % n;
    for (std::uint32_t at = first; at < last; at += n)
      face({at + s, at + next, at + n + next, at + n + s}, material);
    face({below, first + next, first + s}, material);
    face({above, last + s, last + next}, material);
  }
}

void Model::write(const std::string& path, const std::string& made_by) const {
  if (!path.ends_with(".obj")) throw std::runtime_error(path + ": the name of the scene must end in .obj");
  const std::string mtl = path.substr(0, path.size() - 4) + ".mtl";
  std::string text = fmt::format("# {}\n", made_by);
  for (const MaterialText& m : materials_) {
    const double scale = std::numbers::inv_pi;  // Ke is radiance
    text += fmt::format("newmtl {}\nKd {} {} {}\nKe {} {} {}\n", m.name, m.reflectance.red,
                        m.reflectance.green, m.reflectance.blue, m.exitance.red * scale,
                        m.exitance.green * scale, m.exitance.blue * scale);
  }
  save(mtl, text);

  text = fmt::format("# {}: {} polygons, {} triangles; metres\nmtllib {}\n", made_by, polygons(), triangles(),
                     file_name(mtl));
  for (const Point& p : vertices_) text += fmt::format("v {} {} {}\n", length(p.x), length(p.y), length(p.z));
  std::uint32_t material = ~0u, object = ~0u;
  for (const Face& f : faces_) {
    if (f.object != object) text += fmt::format("o {}\n", objects_[object = f.object]);
    if (f.material != material) text += fmt::format("usemtl {}\n", materials_[material = f.material].name);
    text += "f";
    for (std::uint32_t i = 0; i < f.corners; ++i) text += fmt::format(" {}", f.vertex[i] + 1);
    text += "\n";
  }
  save(path, text);
}

}  // namespace make_scene

/// Builds polygon scenes and writes them as OBJ with MTL. Used by make_scene.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace make_scene {

struct Point {
  double x, y, z;  // [m], z up
};

struct Color {
  double red, green, blue;
};

struct MaterialText {
  std::string name;
  Color reflectance;
  Color exitance;  // [W/m^2]
};

/// A turn about the vertical, as the pair cosine and sine; `turned(t)` needs no trigonometry and so is the
/// same everywhere.
struct Turn {
  double cosine = 1, sine = 0;
};
Turn turned(double t);  // t in [0, 1): 0 to 90 degrees

/// splitmix64 (Steele, Lea & Flood 2014): the same numbers on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double between(double low, double high);

 private:
  std::uint64_t next();
  std::uint64_t state_;
};

class Model {
 public:
  /// Materials are known by the number returned.
  std::uint32_t material(const MaterialText& text);

  /// A room [0, size], facing inward; the first `split` of its floor and walls (at most 5) are pairs of
  /// triangles.
  void room(const Point& size, std::uint32_t floor, std::uint32_t walls, std::uint32_t ceiling,
            int split = 0);

  /// A closed box facing outward: `middle` is the middle of its bottom, `size` its edges, turned about the
  /// vertical through `middle`. The bottom face has material `bottom`.
  void box(const std::string& name, const Point& middle, const Point& size, std::uint32_t material,
           std::uint32_t bottom, const Turn& turn = {});
  void box(const std::string& name, const Point& middle, const Point& size, std::uint32_t material,
           const Turn& turn = {}) {
    box(name, middle, size, material, material, turn);
  }

  /// A closed solid of revolution with `sides` flat sides, facing outward: rings of (radius, height above
  /// `foot`) from the bottom up, closed by fans of triangles.
  struct Ring {
    double radius, height;
  };
  void lathe(const std::string& name, const Point& foot, const std::vector<Ring>& rings, int sides,
             std::uint32_t material);

  struct Face {
    std::array<std::uint32_t, 4> vertex;
    std::uint32_t corners, material, object;
  };
  const std::vector<Point>& vertices() const { return vertices_; }
  const std::vector<Face>& faces() const { return faces_; }
  const std::vector<MaterialText>& materials() const { return materials_; }

  std::size_t polygons() const { return faces_.size(); }
  std::size_t triangles() const;

  /// Writes `path` (ending in .obj) and the MTL file beside it; coordinates rounded to a nanometre. Throws
  /// std::runtime_error when a file cannot be written.
  void write(const std::string& path, const std::string& made_by) const;

 private:
  std::uint32_t vertex(const Point& p);
  void face(std::initializer_list<std::uint32_t> corners, std::uint32_t material);
  void object(const std::string& name) { objects_.push_back(name); }

  std::vector<Point> vertices_;
  std::vector<Face> faces_;
  std::vector<std::string> objects_;
  std::vector<MaterialText> materials_;
};

}  // namespace make_scene

/// The light pass over the text of OBJ and MTL files: which line each thing stands on, and its numbers to the
/// last bit.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "scene/raw_scene.hpp"

namespace clrad {

/// A decimal number, rounded correctly; none when `text` is anything else. "nan" and "inf" are numbers here.
std::optional<double> parse_number(std::string_view text);

/// The words of a line, split at blanks and tabs.
std::vector<std::string_view> words_of(std::string_view line);

/// Text whose lines all end with LF, without a byte order mark.
std::string with_plain_lines(std::string text);

/// Calls visit(line number from 1, line without its end) for each line.
template <class Visit>
void for_each_line(std::string_view text, Visit visit) {
  std::uint32_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    visit(++number, line);
  }
}

struct ObjFaceLine {
  std::uint32_t line;
  std::int32_t usemtl;     ///< index into ObjLines::usemtl of the one in force, or -1
  std::size_t first_uv{};  ///< of its corners in ObjLines::uv_of_corner, in a file with texture coordinates
};

struct ObjNameLine {
  std::uint32_t line;
  std::string name;
};

struct ObjLines {
  std::vector<glm::dvec3> vertices;  ///< all `v`, in order; NaN where the line is wrong
  std::vector<ObjFaceLine> faces;    ///< the `f` that can be used, in order
  std::vector<glm::dvec2> uv;        ///< all `vt`, in order; NaN where the line is wrong
  /// Per corner of the faces its `vt`, or no_uv, or wrong_uv where it names one that there is not. Empty in a file without `vt`.
  std::vector<std::uint32_t> uv_of_corner;
  static constexpr std::uint32_t no_uv = 0xffffffffu, wrong_uv = 0xfffffffeu;
  std::vector<ObjNameLine> usemtl;  ///< each with its material's name
  std::vector<ObjNameLine> mtllib;  ///< each with the rest of its line
  std::string text;                 ///< the file with lines that cannot be used blanked out
};

/// Scans an OBJ file's text; what cannot be used is reported in `scene.diagnostics` and blanked out.
ObjLines scan_obj(std::string text, RawScene& scene);

/// A material of an MTL file, before units: what its lines say, and where.
struct MtlMaterial {
  std::string name;
  std::uint32_t line;  ///< of its `newmtl`
  std::array<double, 3> reflectance{0, 0, 0};
  std::array<double, 3> radiance{0, 0, 0};
  std::uint32_t reflectance_line = 0;  ///< 0: the file does not say
  std::uint32_t radiance_line = 0;
  std::uint32_t texture_line = 0;                 ///< of its `map_Kd`; 0: it has none
  int illumination = 2;                           ///< `illum`
  std::array<double, 3> mirrored{0, 0, 0};        ///< `Ks`
  std::optional<std::array<double, 3>> filtered;  ///< `Tf`
  double dissolve = 1;                            ///< `d`, or 1 - `Tr`
  double ior = 1.5;                               ///< `Ni`
  std::vector<Diagnostic> specular_findings;  ///< about these five; they matter for mirrors and glass only

  bool is_mirror() const { return illumination == 3 || illumination == 5; }
  bool is_glass() const {
    return illumination == 4 || illumination == 6 || illumination == 7 || illumination == 9;
  }
};

/// Scans an MTL file's text, in file order.
std::vector<MtlMaterial> scan_mtl(const std::string& file, std::string_view text, RawScene& scene);

}  // namespace clrad

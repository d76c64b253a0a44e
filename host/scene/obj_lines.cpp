#include "scene/obj_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace clrad {
namespace {

using Severity = Diagnostic::Severity;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostCorners = 255;  // tinyobjloader counts the corners of a face in a byte

std::string_view trimmed(std::string_view s) {
  const auto begin = s.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return s.substr(begin, s.find_last_not_of(" \t") - begin + 1);
}

std::optional<std::int64_t> parse_index(std::string_view corner) {
  const std::string_view digits = corner.substr(0, corner.find('/'));
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

glm::dvec3 parse_vertex(const std::vector<std::string_view>& words, const SourceLocation& where,
                        RawScene& scene) {
  glm::dvec3 vertex(kNan);
  if (words.size() < 4) {
    scene.add(Severity::error, "vertex", where,
              fmt::format("a vertex needs three coordinates, this one has {}; is the file cut off?",
                          words.size() - 1));
    return vertex;
  }
  for (int k = 0; k < 3; ++k) {
    const auto value = parse_number(words[1 + k]);
    if (value && std::isfinite(*value)) {
      vertex[k] = *value;
      continue;
    }
    scene.add(Severity::error, "vertex", where,
              fmt::format("coordinate {} is \"{}\"; write a finite decimal number", "xyz"[k], words[1 + k]));
    return glm::dvec3(kNan);
  }
  return vertex;
}

// `vt u [v [w]]`; NaN where it is something else, which matters where a texture is.
glm::dvec2 parse_texture_coordinates(const std::vector<std::string_view>& words) {
  const auto number = [&](std::size_t k) {
    return words.size() > k ? parse_number(words[k]).value_or(kNan) : 0.0;
  };
  return {words.size() > 1 ? number(1) : kNan, number(2)};
}

// The `vt` that a corner `v/vt/vn` names, counted from 0.
std::uint32_t texture_index_of(std::string_view corner, std::size_t before, std::size_t total) {
  const std::size_t slash = corner.find('/');
  if (slash == std::string_view::npos) return ObjLines::no_uv;
  corner.remove_prefix(slash + 1);
  corner = corner.substr(0, corner.find('/'));
  if (corner.empty()) return ObjLines::no_uv;
  const auto index = parse_index(corner).value_or(0);
  const std::int64_t number = index < 0 ? static_cast<std::int64_t>(before) + index + 1 : index;
  return number < 1 || number > static_cast<std::int64_t>(total) ? ObjLines::wrong_uv
                                                                 : std::uint32_t(number - 1);
}

// What is wrong with the corners of a face, if anything. `before` and `total` count vertices.
struct FaceFault {
  const char* rule;
  std::string message;
};
std::optional<FaceFault> fault_of(const std::vector<std::string_view>& words, std::size_t before,
                                  std::size_t total) {
  for (std::size_t i = 1; i < words.size(); ++i) {
    const auto index = parse_index(words[i]);
    if (!index || *index == 0) {
      return FaceFault{"face-index",
                       fmt::format("\"{}\" is not a vertex; a face lists numbers from 1, or negative ones "
                                   "counting back",
                                   words[i])};
    }
    const std::int64_t vertex = *index > 0 ? *index : static_cast<std::int64_t>(before) + *index + 1;
    if (vertex < 1 || vertex > static_cast<std::int64_t>(total)) {
      return FaceFault{"face-index",
                       fmt::format("corner {} names vertex {}, but there are {}; is the file cut off?", i,
                                   *index, *index > 0 ? total : before)};
    }
  }
  const std::size_t corners = words.size() - 1;
  if (corners < 3) {
    return FaceFault{
        "too-few-corners",
        fmt::format("a face needs three corners, this one has {}; complete or remove it", corners)};
  }
  if (corners > kMostCorners) {
    return FaceFault{
        "too-many-corners",
        fmt::format("a face has at most {} corners, this one has {}; split it", kMostCorners, corners)};
  }
  return std::nullopt;
}

// `Kd r g b` or `Kd grey`.
std::optional<std::array<double, 3>> parse_color(const std::vector<std::string_view>& words,
                                                 const SourceLocation& where, RawScene& scene) {
  const std::size_t count = words.size() - 1;
  std::array<double, 3> color{};
  bool fine = count == 1 || count == 3;
  for (std::size_t k = 0; fine && k < 3; ++k) {
    const auto value = parse_number(words[count == 1 ? 1 : 1 + k]);
    fine = value.has_value();
    color[k] = value.value_or(0);
  }
  if (fine) return color;
  scene.add(
      Severity::error, "number", where,
      fmt::format("{} takes one decimal number or three (spectral and xyz forms are not read)", words[0]));
  return std::nullopt;
}

// A keyword with one number. Text after it, such as that of `d -halo`, makes it something else.
std::optional<double> parse_scalar(const std::vector<std::string_view>& words, const SourceLocation& where,
                                   RawScene& scene) {
  const auto value = words.size() == 2 ? parse_number(words[1]) : std::nullopt;
  if (value && std::isfinite(*value)) return value;
  scene.add(Severity::error, "number", where, fmt::format("{} takes one decimal number", words[0]));
  return std::nullopt;
}

// The lines that say how a material mirrors and transmits; true when this was one.
bool scan_specular(std::vector<std::string_view> words, std::string_view line, const SourceLocation& where,
                   MtlMaterial& material) {
  const std::string_view keyword = words[0];
  const bool color = keyword == "Ks" || keyword == "Tf";
  if (!color && keyword != "Ni" && keyword != "d" && keyword != "Tr" && keyword != "illum") return false;
  words = words_of(line.substr(0, line.find('#')));
  RawScene found;
  if (color) {
    if (const auto values = parse_color(words, where, found))
      (keyword == "Ks" ? material.mirrored : material.filtered.emplace()) = *values;
  } else if (const auto value = parse_scalar(words, where, found)) {
    if (keyword == "illum") material.illumination = int(std::clamp(*value, -1.0, 99.0));
    if (keyword == "Ni") material.ior = *value;
    if (keyword == "d") material.dissolve = *value;
    if (keyword == "Tr") material.dissolve = 1 - *value;
  }
  material.specular_findings.insert(material.specular_findings.end(), found.diagnostics.begin(),
                                    found.diagnostics.end());
  return true;
}

}  // namespace

std::string with_plain_lines(std::string text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.replace(0, 3, "   ");
  std::size_t kept = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') continue;
    text[kept++] = text[i] == '\r' ? '\n' : text[i];
  }
  text.resize(kept);
  return text;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (;;) {
    const auto begin = line.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return words;
    const auto end = std::min(line.find_first_of(" \t", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

ObjLines scan_obj(std::string text, RawScene& scene) {
  ObjLines lines;
  lines.text = with_plain_lines(std::move(text));
  std::size_t total = 0, total_uv = 0;
  for_each_line(lines.text, [&](std::uint32_t, std::string_view line) {
    line = trimmed(line);
    total_uv += line.starts_with("vt ") || line.starts_with("vt\t");
    if (!line.starts_with("v ") && !line.starts_with("v\t")) return;
    // A `v` without a number is an error below, and no vertex.
    total += line[line.find_first_not_of(" \t", 1)] != '#';
  });
  lines.vertices.reserve(total);
  std::uint32_t ignored = 0, first_ignored = 0;
  for_each_line(lines.text, [&](std::uint32_t number, std::string_view line) {
    auto words = words_of(line);
    if (words.empty()) return;
    const SourceLocation where{scene.file, number, ""};
    const std::string_view keyword = words[0];
    // The text is ours to change; the views into it stay valid.
    const auto blank = [&, begin = line.data() - lines.text.data()](std::size_t from = 0,
                                                                    std::size_t to = std::string_view::npos) {
      std::fill(lines.text.begin() + begin + static_cast<std::ptrdiff_t>(from),
                lines.text.begin() + begin + static_cast<std::ptrdiff_t>(std::min(to, line.size())), ' ');
    };
    const std::size_t comment = line.find('#');
    if ((keyword == "v" || keyword == "f") && comment != std::string_view::npos) {
      blank(comment);  // the library takes a comment at the end of a face for a corner
      words = words_of(line);
    }
    if (keyword == "v" && words.size() == 1) {
      parse_vertex(words, where, scene);
      blank();
    } else if (keyword == "v") {
      lines.vertices.push_back(parse_vertex(words, where, scene));
    } else if (keyword == "f") {
      if (const auto fault = fault_of(words, lines.vertices.size(), total)) {
        scene.add(Severity::error, fault->rule, where, fault->message);
        blank();
      } else {
        lines.faces.push_back(
            {number, static_cast<std::int32_t>(lines.usemtl.size()) - 1, lines.uv_of_corner.size()});
        if (total_uv > 0)
          for (std::size_t i = 1; i < words.size(); ++i)
            lines.uv_of_corner.push_back(texture_index_of(words[i], lines.uv.size(), total_uv));
        // Normals are not used, and texture coordinates are read above; the library would judge their indices.
        for (const std::string_view word : words) {
          if (const auto slash = word.find('/'); slash != std::string_view::npos)
            blank(static_cast<std::size_t>(word.data() - line.data()) + slash,
                  static_cast<std::size_t>(word.data() - line.data()) + word.size());
        }
      }
    } else if (keyword == "vt") {
      lines.uv.push_back(parse_texture_coordinates(words_of(line.substr(0, comment))));
    } else if (keyword == "usemtl") {
      lines.usemtl.push_back({number, words.size() > 1 ? std::string(words[1]) : std::string()});
    } else if (keyword == "mtllib") {
      lines.mtllib.push_back({number, std::string(trimmed(trimmed(line).substr(keyword.size())))});
    } else if (keyword == "l" || keyword == "p" || keyword == "curv" || keyword == "surf" ||
               keyword == "curv2") {
      if (ignored++ == 0) first_ignored = number;
      blank();
    } else if (keyword == "vw" || keyword == "t") {
      blank();  // extensions of tinyobjloader that make it give up on other uses of these words
    }
  });
  if (ignored > 0) {
    scene.add(
        Severity::warning, "element-ignored", {scene.file, first_ignored, ""},
        fmt::format("{} points, lines, curves or free-form surfaces are ignored; only faces count", ignored));
  }
  return lines;
}

std::vector<MtlMaterial> scan_mtl(const std::string& file, std::string_view text, RawScene& scene) {
  std::vector<MtlMaterial> materials;
  for_each_line(text, [&](std::uint32_t number, std::string_view line) {
    auto words = words_of(line);
    if (words.empty()) return;
    const SourceLocation where{file, number, ""};
    if (words[0] == "Kd" || words[0] == "Ke") words = words_of(line.substr(0, line.find('#')));
    if (words[0] == "newmtl") {
      if (words.size() < 2) {
        scene.add(Severity::error, "number", where, "newmtl needs a name");
        return;
      }
      materials.emplace_back();
      materials.back().name = words[1];
      materials.back().line = number;
    } else if (!materials.empty() && scan_specular(words, line, where, materials.back())) {
      return;
    } else if ((words[0] == "Kd" || words[0] == "Ke") && materials.empty()) {
      scene.add(Severity::error, "number", where, fmt::format("{} stands before the first newmtl", words[0]));
    } else if (words[0] == "Kd") {
      materials.back().reflectance_line = number;
      if (const auto color = parse_color(words, where, scene)) materials.back().reflectance = *color;
    } else if (words[0] == "map_Kd" && !materials.empty()) {
      materials.back().texture_line = number;
    } else if (words[0] == "Ke") {
      materials.back().radiance_line = number;
      if (const auto color = parse_color(words, where, scene)) materials.back().radiance = *color;
    }
  });
  return materials;
}

}  // namespace clrad

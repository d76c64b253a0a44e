/// glTF files written as text with embedded base64 buffers.
#pragma once
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace clrad_test {

inline std::string base64(const std::string& bytes) {
  const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k)
      v = v << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? digits[v >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A glTF document; `json` can be changed before text() or binary() is taken.
class Gltf {
 public:
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}};

  int positions(const std::vector<std::array<float, 3>>& p) {
    return accessor(p.data(), p.size() * 12, 5126, p.size(), "VEC3");
  }
  template <class Int>
  int indices(const std::vector<Int>& i) {
    const int type = sizeof(Int) == 1 ? 5121 : sizeof(Int) == 2 ? 5123 : 5125;
    return accessor(i.data(), i.size() * sizeof(Int), type, i.size(), "SCALAR");
  }
  int material(const nlohmann::json& m) { return add("materials", m); }
  int mesh(const std::vector<nlohmann::json>& primitives) {
    return add("meshes", {{"primitives", primitives}});
  }
  int node(const nlohmann::json& n) { return add("nodes", n); }

  std::string text() const {
    nlohmann::json j = json;
    j["buffers"] = {
        {{"byteLength", bytes_.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes_)}}};
    return j.dump(1);
  }
  std::string binary() const {
    nlohmann::json j = json;
    j["buffers"] = {{{"byteLength", bytes_.size()}}};
    std::string text = j.dump(), data = bytes_;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4, '\0');
    const auto size = [](std::size_t n) {
      const auto v = static_cast<std::uint32_t>(n);
      return std::string(reinterpret_cast<const char*>(&v), 4);
    };
    return "glTF" + size(2) + size(28 + text.size() + data.size()) + size(text.size()) + "JSON" + text +
           size(data.size()) + std::string("BIN\0", 4) + data;
  }

  int add(const char* array, const nlohmann::json& element) {
    json[array].push_back(element);
    return static_cast<int>(json[array].size()) - 1;
  }

 private:
  int accessor(const void* data, std::size_t size, int component, std::size_t count, const char* type) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    const int view = add("bufferViews", {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", size}});
    bytes_.append(static_cast<const char*>(data), size);
    return add("accessors",
               {{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
  }
  std::string bytes_;
};

}  // namespace clrad_test

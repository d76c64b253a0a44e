#include "scene/gltf_geometry.hpp"

#include <fmt/format.h>

#include <cstring>
#include <numeric>

namespace clrad {
namespace {

// Where the elements of an accessor lie in memory.
struct Elements {
  const unsigned char* data;
  std::size_t stride, count;
};

Elements elements_of(const tinygltf::Model& model, int accessor_index, const char* what) {
  const auto fault = [&](const std::string& message) {
    return GltfFault("accessor", fmt::format("{}: {}", what, message));
  };
  if (accessor_index < 0 || std::size_t(accessor_index) >= model.accessors.size()) {
    throw fault(fmt::format("accessor {} does not exist", accessor_index));
  }
  const tinygltf::Accessor& accessor = model.accessors[std::size_t(accessor_index)];
  if (accessor.sparse.isSparse) throw fault("sparse accessors are not read; export without them");
  if (accessor.bufferView < 0 || std::size_t(accessor.bufferView) >= model.bufferViews.size()) {
    throw fault(fmt::format("bufferView {} does not exist", accessor.bufferView));
  }
  const tinygltf::BufferView& view = model.bufferViews[std::size_t(accessor.bufferView)];
  if (view.buffer < 0 || std::size_t(view.buffer) >= model.buffers.size()) {
    throw fault(fmt::format("buffer {} does not exist", view.buffer));
  }
  const std::vector<unsigned char>& bytes = model.buffers[std::size_t(view.buffer)].data;
  const int component = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  const int stride = accessor.ByteStride(view);
  if (component <= 0 || components <= 0 || stride <= 0)
    throw fault("its type or stride is not one of glTF's");
  const std::size_t element = std::size_t(component) * std::size_t(components);
  const std::size_t room =
      view.byteOffset <= bytes.size() ? std::min(view.byteLength, bytes.size() - view.byteOffset) : 0;
  const std::size_t step = std::size_t(stride);
  const bool fits =
      accessor.count == 0 || (accessor.byteOffset <= room && element <= room - accessor.byteOffset &&
                              (accessor.count - 1) <= (room - accessor.byteOffset - element) / step);
  if (!fits) throw fault("it reaches past the end of its buffer; is the file cut off?");
  return {bytes.data() + view.byteOffset + accessor.byteOffset, step, accessor.count};
}

template <class T>
T value_at(const unsigned char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

std::vector<std::uint32_t> read_indices(const tinygltf::Model& model, int accessor_index) {
  const Elements elements = elements_of(model, accessor_index, "indices");
  const tinygltf::Accessor& accessor = model.accessors[std::size_t(accessor_index)];
  if (accessor.type != TINYGLTF_TYPE_SCALAR) throw GltfFault("accessor", "indices: must be scalars");
  std::vector<std::uint32_t> indices(elements.count);
  for (std::size_t i = 0; i < elements.count; ++i) {
    const unsigned char* at = elements.data + i * elements.stride;
    switch (accessor.componentType) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        indices[i] = *at;
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        indices[i] = value_at<std::uint16_t>(at);
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        indices[i] = value_at<std::uint32_t>(at);
        break;
      default:
        throw GltfFault("accessor", "indices: must be unsigned bytes, shorts or ints");
    }
  }
  return indices;
}

}  // namespace

std::vector<glm::dvec3> read_positions(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end())
    throw GltfFault("accessor", "it has no POSITION; remove or complete it");
  const Elements elements = elements_of(model, position->second, "POSITION");
  const tinygltf::Accessor& accessor = model.accessors[std::size_t(position->second)];
  const bool is_float = accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
  const bool is_double = accessor.componentType == TINYGLTF_COMPONENT_TYPE_DOUBLE;
  if (accessor.type != TINYGLTF_TYPE_VEC3 || (!is_float && !is_double)) {
    throw GltfFault("accessor", "POSITION: must be vectors of three floats");
  }
  std::vector<glm::dvec3> positions(elements.count);
  for (std::size_t i = 0; i < elements.count; ++i) {
    const unsigned char* at = elements.data + i * elements.stride;
    for (int k = 0; k < 3; ++k) {
      positions[i][k] = is_float ? double(value_at<float>(at + 4 * k)) : value_at<double>(at + 8 * k);
    }
  }
  return positions;
}

std::vector<glm::dvec2> read_texture_coordinates(const tinygltf::Model& model,
                                                 const tinygltf::Primitive& primitive, int set,
                                                 std::size_t vertices) {
  const std::string name = fmt::format("TEXCOORD_{}", set);
  const auto attribute = primitive.attributes.find(name);
  if (attribute == primitive.attributes.end()) return {};
  const Elements elements = elements_of(model, attribute->second, name.c_str());
  const tinygltf::Accessor& accessor = model.accessors[std::size_t(attribute->second)];
  const int type = accessor.componentType;
  const std::size_t size = type == TINYGLTF_COMPONENT_TYPE_FLOAT            ? 4
                           : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 2
                           : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE  ? 1
                                                                            : 0;
  if (accessor.type != TINYGLTF_TYPE_VEC2 || size == 0)
    throw GltfFault("accessor", name + ": must be pairs of floats, unsigned bytes or unsigned shorts");
  if (elements.count != vertices)
    throw GltfFault("accessor",
                    fmt::format("{}: there are {}, but {} positions", name, elements.count, vertices));
  std::vector<glm::dvec2> uv(elements.count);
  for (std::size_t i = 0; i < elements.count; ++i)
    for (int k = 0; k < 2; ++k) {
      const unsigned char* at = elements.data + i * elements.stride + std::size_t(k) * size;
      uv[i][k] = size == 4   ? double(value_at<float>(at))
                 : size == 2 ? value_at<std::uint16_t>(at) / 65535.0
                             : *at / 255.0;
    }
  return uv;
}

std::vector<std::array<std::uint32_t, 3>> read_triangles(const tinygltf::Model& model,
                                                         const tinygltf::Primitive& primitive,
                                                         std::size_t vertices) {
  std::vector<std::uint32_t> indices;
  if (primitive.indices >= 0) {
    indices = read_indices(model, primitive.indices);
  } else {
    indices.resize(vertices);
    std::iota(indices.begin(), indices.end(), 0u);
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < vertices) continue;
    throw GltfFault("index",
                    fmt::format("index {} is {}, but there are {} vertices", i, indices[i], vertices));
  }
  const std::size_t n = indices.size();
  std::vector<std::array<std::uint32_t, 3>> triangles;
  if (primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (std::size_t i = 0; i + 2 < n; ++i) {
      triangles.push_back({indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]});
    }
  } else if (primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN) {
    for (std::size_t i = 1; i + 1 < n; ++i) triangles.push_back({indices[i], indices[i + 1], indices[0]});
  } else {
    if (n % 3 != 0)
      throw GltfFault("index", fmt::format("{} indices are not a whole number of triangles", n));
    for (std::size_t i = 0; i + 2 < n; i += 3)
      triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  }
  return triangles;
}

}  // namespace clrad

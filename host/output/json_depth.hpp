// How deep JSON nests, found before anything that recurses over it reads it.
#pragma once
#include <nlohmann/json.hpp>
#include <string_view>

namespace clrad {

/// Levels of arrays and objects that clrad reads. Parsers of nested values call themselves a level a call; a hostile file
/// of a megabyte of brackets would overflow the stack.
constexpr int deepest_json = 256;

/// True when the value, up to the first error if there is one, nests deeper than deepest_json. Text or CBOR.
bool nests_too_deeply(std::string_view bytes, nlohmann::json::input_format_t format);

}  // namespace clrad

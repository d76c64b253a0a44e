#include "output/json_depth.hpp"

namespace clrad {
namespace {

// The library's event interface: a false ends the parsing there, before it goes a level further down.
struct Depth : nlohmann::json_sax<nlohmann::json> {
  int now = 0;
  bool exceeded = false;

  bool down() {
    exceeded = ++now > deepest_json;
    return !exceeded;
  }
  bool up() {
    --now;
    return true;
  }
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return down(); }
  bool key(string_t&) override { return true; }
  bool end_object() override { return up(); }
  bool start_array(std::size_t) override { return down(); }
  bool end_array() override { return up(); }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override {
    return false;
  }
};

}  // namespace

bool nests_too_deeply(std::string_view bytes, nlohmann::json::input_format_t format) {
  Depth depth;
  nlohmann::json::sax_parse(bytes.begin(), bytes.end(), &depth, format);
  return depth.exceeded;
}

}  // namespace clrad

// View factors as files: MatrixMarket, NPZ (SciPy's CSR), View3D's text, and the JSON report beside them.
#include "clrad/view_factors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "clrad/output.hpp"
#include "output/file.hpp"
#include "output/zip.hpp"
#include "version.hpp"

namespace clrad {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

// Text goes out in pieces of this size.
constexpr std::size_t piece_bytes = 1 << 20;

class TextWriter {
 public:
  explicit TextWriter(const std::string& path) : file_(path) {}
  template <class... Args>
  void print(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    if (text_.size() > piece_bytes) flush();
  }
  void commit() {
    flush();
    file_.commit();
  }

 private:
  void flush() {
    file_.write(std::string_view(text_.data(), text_.size()));
    text_.clear();
  }
  FileWriter file_;
  std::string text_;
};

// Names come from files: no line breaks in formats of lines.
std::string one_line(std::string name) {
  for (char& c : name)
    if (std::uint8_t(c) < 32 || c == 127) c = ' ';
  if (name.size() > 200) name.resize(200);
  return name;
}

// https://math.nist.gov/MatrixMarket/formats.html
void write_matrix_market(const std::string& path, const ViewFactors& f) {
  TextWriter out(path);
  out.print("%%MatrixMarket matrix coordinate real general\n");
  out.print("% clrad {}: view factor from row to column; rows: number, area_m2, emissivity, name\n", version);
  for (std::uint32_t i = 0; i < f.rows(); ++i)
    out.print("% row {} {:.17g} {:.9g} {}\n", i + 1, f.area_m2[i], f.emissivity[i], one_line(f.name[i]));
  out.print("{} {} {}\n", f.rows(), f.rows(), f.column.size());
  for (std::uint32_t i = 0; i < f.rows(); ++i)
    for (std::uint64_t k = f.first[i]; k < f.first[i + 1]; ++k)
      out.print("{} {} {:.17g}\n", i + 1, f.column[k] + 1, f.factor[k]);
  out.commit();
}

// NumPy's .npy, format 1.0: magic, version, length of the header, a Python dictionary padded to 64 bytes, the data.
std::string npy(const std::string& type, const std::string& shape, std::string_view data) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", type, shape);
  header.append(63 - (10 + header.size()) % 64, ' ');
  header.push_back('\n');
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes.push_back(char(header.size() & 255));
  bytes.push_back(char(header.size() >> 8));
  bytes += header;
  bytes += data;
  return bytes;
}

template <class T>
std::string npy(const std::string& type, const std::vector<T>& values) {
  return npy(type, fmt::format("({},)", values.size()),
             {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

// UTF-8 to code points; a byte that is none stands for itself.
std::u32string code_points(const std::string& text) {
  std::u32string result;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = std::uint8_t(text[i]);
    const std::size_t length = lead < 0x80       ? 1
                               : lead >> 5 == 6  ? 2
                               : lead >> 4 == 14 ? 3
                               : lead >> 3 == 30 ? 4
                                                 : 1;
    char32_t point = length == 1 ? lead : lead & (0x7f >> length);
    bool whole = i + length <= text.size();
    for (std::size_t k = 1; k < length && whole; ++k) {
      whole = (std::uint8_t(text[i + k]) & 0xc0) == 0x80;
      point = point << 6 | (std::uint8_t(text[i + k]) & 0x3f);
    }
    result.push_back(whole ? point : char32_t(lead));
    i += whole ? length : 1;
  }
  return result;
}

std::string npy_of_names(const std::vector<std::string>& names) {
  std::vector<std::u32string> all;
  std::size_t longest = 1;
  for (const auto& name : names) {
    all.push_back(code_points(name));
    longest = std::max(longest, all.back().size());
  }
  std::string data(names.size() * longest * 4, '\0');
  for (std::size_t i = 0; i < all.size(); ++i)
    std::copy_n(reinterpret_cast<const char*>(all[i].data()), all[i].size() * 4,
                data.data() + i * longest * 4);
  return npy(fmt::format("<U{}", longest), fmt::format("({},)", names.size()), data);
}

// What scipy.sparse.save_npz writes of a csr_matrix, and arrays of our own beside it, which load_npz does not look at.
void write_npz(const std::string& path, const ViewFactors& f) {
  FileWriter file(path);
  ZipWriter zip(file);
  std::vector<std::int32_t> indices(f.column.begin(), f.column.end());
  zip.add("indices.npy", npy("<i4", indices));
  if (f.column.size() <= 0x7fffffffu)
    zip.add("indptr.npy", npy("<i4", std::vector<std::int32_t>(f.first.begin(), f.first.end())));
  else
    zip.add("indptr.npy", npy("<i8", f.first));
  zip.add("format.npy", npy("|S3", "()", "csr"));
  zip.add("shape.npy", npy("<i8", std::vector<std::int64_t>{f.rows(), f.rows()}));
  zip.add("data.npy", npy("<f8", f.factor));
  zip.add("error.npy", npy("<f8", f.error));
  zip.add("area_m2.npy", npy("<f8", f.area_m2));
  zip.add("emissivity.npy", npy("<f8", f.emissivity));
  zip.add("row_sum.npy", npy("<f8", f.row_sum));
  zip.add("name.npy", npy_of_names(f.name));
  zip.finish();
  file.commit();
}

// View3D 3.2's output format 0 (Walton, NISTIR 6925): program, version, format, enclosure, emissivities included,
// surfaces; then areas, the square matrix row by row, emissivities.
void write_view3d(const std::string& path, const ViewFactors& f) {
  TextWriter out(path);
  out.print("View3D 3.2 0 {} 0 {}\n", f.closed && !f.stopped ? 1 : 0, f.rows());
  for (std::uint32_t i = 0; i < f.rows(); ++i) out.print("{}{:.9g}", i ? " " : "", f.area_m2[i]);
  out.print("\n");
  for (std::uint32_t i = 0; i < f.rows(); ++i) {
    std::uint64_t k = f.first[i];
    for (std::uint32_t j = 0; j < f.rows(); ++j) {
      const bool stored = k < f.first[i + 1] && f.column[k] == j;
      out.print("{}{:.9g}", j ? " " : "", stored ? f.factor[k++] : 0.0);
    }
    out.print("\n");
  }
  for (std::uint32_t i = 0; i < f.rows(); ++i) out.print("{}{:.9g}", i ? " " : "", f.emissivity[i]);
  out.print("\n");
  out.commit();
}

}  // namespace

void write_view_factors(const std::string& path, const ViewFactors& factors) {
  const std::string ending = lower_ending(path);
  if (ending == ".mtx") return write_matrix_market(path, factors);
  if (ending == ".npz") return write_npz(path, factors);
  if (ending == ".vf" || ending == ".txt") return write_view3d(path, factors);
  throw UsageError(
      fmt::format("{}: the ending says the format of view factors: .mtx, .npz, .vf or .txt", path));
}

std::string view_factor_report_json(const ViewFactors& f, const Scene& scene, const Device& device,
                                    const ViewFactorOptions& options, const std::string& matrix_file) {
  Json rows = Json::array();
  for (std::uint32_t i = 0; i < f.rows(); ++i) {
    Json row = {{"name", f.name[i]},       {"where", f.where[i].text()},
                {"area_m2", f.area_m2[i]}, {"emissivity", f.emissivity[i]},
                {"row_sum", f.row_sum[i]}, {"row_error", f.row_error[i]}};
    row["row_defect"] = f.closed && f.complete[i] ? Json(f.row_sum[i] - 1) : Json(nullptr);
    row["complete"] = bool(f.complete[i]);
    rows.push_back(row);
  }
  Json json;
  json["schema"] = "clrad-viewfactors-1";
  json["program"] = {{"version", version}, {"commit", commit}};
  json["scene"] = {{"file", scene.file}, {"polygons", scene.polygons.size()}, {"rows", f.rows()}};
  json["matrix"] = {{"file", matrix_file}, {"entries", f.column.size()}};
  json["device"] = {{"name", device.info().name},
                    {"driver", device.info().driver},
                    {"precision", device.options().precision == Precision::float64 ? "double" : "float"}};
  json["options"] = {{"target_error", options.target_error},
                     {"rows", options.rows == ViewFactorRows::faces ? "face" : "object"}};
  json["stopped"] = f.stopped;
  json["pairs_done"] = f.pairs_done;
  json["pairs_asked"] = f.pairs_asked;
  json["closed"] = f.closed;
  const bool any_row = std::find(f.complete.begin(), f.complete.end(), true) != f.complete.end();
  json["worst_row_defect"] = f.closed && any_row ? Json(f.worst_row_defect) : Json(nullptr);
  json["worst_row_error"] =
      f.row_error.empty() ? 0.0 : *std::max_element(f.row_error.begin(), f.row_error.end());
  json["worst_relative_error"] = f.worst_relative_error;
  json["entries_over_target"] = f.over_target;
  json["reciprocity"] = {{"pairs", f.reciprocity.pairs},
                         {"worst_relative_defect", f.reciprocity.worst},
                         {"its_error_estimate", f.reciprocity.estimated},
                         {"pairs_beyond_estimate", f.reciprocity.beyond},
                         {"pairs_beyond_3_estimates", f.reciprocity.far_beyond}};
  json["pairs"] = f.pairs;
  json["hidden_pairs"] = f.hidden_pairs;
  json["points"] = f.points;
  json["seconds"] = f.seconds;
  json["rows"] = rows;
  return json.dump(1) + "\n";
}

}  // namespace clrad

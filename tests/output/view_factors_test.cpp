// Matrices of view factors as files, read back by other means than those that wrote them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "clrad/view_factors.hpp"
#include "output/zip.hpp"

namespace clrad {
namespace {

// 3 rows; (0, 2) and all of row 1 but one entry are missing, as is row 2's diagonal.
ViewFactors example() {
  ViewFactors f;
  f.name = {"wall", "d\xc3\xa9\nck", ""};
  f.where = {{"a.obj", 1, ""}, {"a.obj", 2, ""}, {"a.obj", 3, ""}};
  f.area_m2 = {1, 2.5, 1.0 / 3};
  f.emissivity = {0.5, 1, 0.25};
  f.first = {0, 2, 3, 5};
  f.column = {0, 1, 2, 0, 1};
  f.factor = {0.1, 1e-9, 1.0 / 3, 0.25, 0.7};
  f.error = {1e-6, 1e-12, 1e-7, 0, 1e-8};
  f.row_sum = {0.1 + 1e-9, 1.0 / 3, 0.95};
  f.row_error = {1e-6, 1e-7, 1e-8};
  return f;
}

class ViewFactorFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("clrad_view_factors_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const {
    std::ifstream in(folder_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::filesystem::path folder_;
};

TEST_F(ViewFactorFiles, MatrixMarket) {
  const ViewFactors f = example();
  write_view_factors(path("f.mtx"), f);
  std::istringstream in(text("f.mtx"));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "%%MatrixMarket matrix coordinate real general");
  int comments = 0;
  while (in.peek() == '%' && std::getline(in, line)) {
    ++comments;
    EXPECT_LE(line.size(), 1024u);
  }
  EXPECT_EQ(comments, 4);
  std::size_t rows = 0, columns = 0, entries = 0;
  in >> rows >> columns >> entries;
  EXPECT_EQ(rows, 3u);
  EXPECT_EQ(columns, 3u);
  ASSERT_EQ(entries, 5u);
  for (std::size_t k = 0; k < entries; ++k) {
    std::uint32_t i = 0, j = 0;
    double value = 0;
    ASSERT_TRUE(in >> i >> j >> value);
    EXPECT_EQ(value, f.at(i - 1, j - 1));  // 17 digits give the same double
    EXPECT_GT(value, 0);
  }
  EXPECT_FALSE(in >> line);
}

TEST_F(ViewFactorFiles, NumpyArchive) {
  const ViewFactors f = example();
  write_view_factors(path("f.npz"), f);
  const std::string script = std::filesystem::path(CLRAD_TEST_DATA).parent_path() / "output" / "read_npz.py";
  const int status = std::system(
      ("/usr/bin/python3 '" + script + "' '" + path("f.npz") + "' > '" + path("f.json") + "' 2>&1").c_str());
  ASSERT_EQ(status, 0) << text("f.json");
  const auto arrays = nlohmann::json::parse(text("f.json"));
  const auto values = [&](const char* name) { return arrays.at(std::string(name) + ".npy").at("values"); };
  EXPECT_EQ(values("format"), nlohmann::json({"csr"}));
  EXPECT_EQ(values("shape"), nlohmann::json({3, 3}));
  EXPECT_TRUE(arrays.at("format.npy").at("shape").empty());
  EXPECT_EQ(values("indptr"), nlohmann::json(f.first));
  EXPECT_EQ(values("indices"), nlohmann::json(f.column));
  EXPECT_EQ(values("data").get<std::vector<double>>(), f.factor);
  EXPECT_EQ(values("error").get<std::vector<double>>(), f.error);
  EXPECT_EQ(values("area_m2").get<std::vector<double>>(), f.area_m2);
  EXPECT_EQ(values("emissivity").get<std::vector<double>>(), f.emissivity);
  EXPECT_EQ(values("row_sum").get<std::vector<double>>(), f.row_sum);
  EXPECT_EQ(values("name"), nlohmann::json(f.name));
}

TEST_F(ViewFactorFiles, View3D) {
  const ViewFactors f = example();
  for (const char* name : {"f.vf", "f.txt"}) {
    write_view_factors(path(name), f);
    std::istringstream in(text(name));
    std::string header, program, version;
    std::getline(in, header);
    EXPECT_LT(header.size(), 34u);  // View3D's reader takes 34 characters with the line's end
    int format = -1, enclosure = -1, emissivities = -1, rows = 0;
    ASSERT_TRUE(std::istringstream(header) >> program >> version >> format >> enclosure >> emissivities >>
                rows);
    EXPECT_EQ(program, "View3D");
    EXPECT_EQ(format, 0);
    EXPECT_EQ(enclosure, 0);
    EXPECT_EQ(emissivities, 0);
    ASSERT_EQ(rows, 3);
    const auto near = [&](double want) {  // 9 digits
      double value = NAN;
      ASSERT_TRUE(in >> value);
      EXPECT_NEAR(value, want, 5e-9 * want);
    };
    for (const double area : f.area_m2) near(area);
    for (std::uint32_t i = 0; i < 3; ++i)
      for (std::uint32_t j = 0; j < 3; ++j) near(f.at(i, j));
    for (const double emissivity : f.emissivity) near(emissivity);
    EXPECT_FALSE(in >> header);
  }
}

TEST_F(ViewFactorFiles, UnknownEndingsAreRefusedAndLeaveNothing) {
  EXPECT_THROW(write_view_factors(path("f.csv"), example()), UsageError);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

// The check value of CRC-32/ISO-HDLC.
TEST(Zip, Checksum) {
  EXPECT_EQ(crc32("123456789"), 0xcbf43926u);
}

}  // namespace
}  // namespace clrad

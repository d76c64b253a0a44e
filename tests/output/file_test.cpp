#include <sys/stat.h>

#include "clrad/error.hpp"
#include "clrad/output.hpp"
#include "output/support.hpp"

namespace clrad {
namespace {

class WholeFile : public test::FileTest {};

TEST_F(WholeFile, ReplacesWhatWasThere) {
  const std::string path = in_folder("a.txt");
  write_file(path, "first, and longer");
  write_file(path, std::string("second\0!", 8));
  EXPECT_EQ(bytes(path), std::string("second\0!", 8));
  EXPECT_EQ(files(), 1u);
}

TEST_F(WholeFile, TakesThePermissionsOfTheUsersMask) {
  const mode_t mask = ::umask(0027);
  write_file(in_folder("a.txt"), "x");
  ::umask(mask);
  struct stat status {};
  ASSERT_EQ(::stat(in_folder("a.txt").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

std::string failure(const std::string& path) {
  try {
    write_file(path, "x");
  } catch (const DeviceError& e) {
    return e.what();
  }
  return "no error";
}

TEST_F(WholeFile, SaysWhichFolderIsMissing) {
  const std::string message = failure(in_folder("missing/a.txt"));
  EXPECT_NE(message.find(in_folder("missing/a.txt")), std::string::npos) << message;
  EXPECT_NE(message.find("there is no folder " + in_folder("missing")), std::string::npos) << message;
  EXPECT_EQ(files(), 0u);
}

TEST_F(WholeFile, LeavesNothingBehindWhenItFails) {
  // A folder of that name: the data is written, the last step fails.
  std::filesystem::create_directories(in_folder("taken/full"));
  const std::string message = failure(in_folder("taken"));
  EXPECT_NE(message.find("cannot write " + in_folder("taken")), std::string::npos) << message;
  EXPECT_EQ(files(), 1u);
  // A file where a folder should be.
  write_file(in_folder("file"), "x");
  EXPECT_NE(failure(in_folder("file/a.txt")).find("cannot write"), std::string::npos);
  EXPECT_EQ(files(), 2u);
  EXPECT_NE(failure("").find("without a name"), std::string::npos);
}

}  // namespace
}  // namespace clrad

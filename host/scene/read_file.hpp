#pragma once
#include <string>

namespace clrad {

/// The whole file as bytes. Throws InputError "path: ..." when it is missing, not a file, not readable, or
/// empty.
std::string read_file(const std::string& path);

}  // namespace clrad

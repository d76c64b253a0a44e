#pragma once
#include <string>

namespace clrad {

/// The whole file as bytes. Throws InputError "path: ..." when it is missing, not a file, not readable, or
/// empty.
std::string read_file(const std::string& path);

/// A library's message as one line: no control characters, no blanks at its end.
std::string one_line(std::string text);

}  // namespace clrad

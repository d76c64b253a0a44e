// Which clrad this is.
#pragma once

namespace clrad {
extern const char* const version;  ///< "0.1.0"
extern const char* const commit;   ///< abbreviated hash, or "unknown"
}  // namespace clrad

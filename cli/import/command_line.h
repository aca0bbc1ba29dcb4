#pragma once

#include <tl/expected.hpp>

#include "cli/import/commands.h"

namespace airworthy::importer {

/// What the user asks for; or, help, version or the error already printed, the exit code.
[[nodiscard]] tl::expected<Request, int> parse_command_line(int argc, const char* const* argv);

}  // namespace airworthy::importer

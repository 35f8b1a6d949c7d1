// What a verb derives and keeps in the campaign file.
#pragma once

#include <string>
#include <string_view>

namespace tunnelrig::cli {

/// Adds a document to the campaign file, with this program's version and arguments. Where the file cannot be
/// written a warning says that it is not kept: what was asked for is delivered all the same.
/// `inputs`: JSON object of ids and hashes, as Provenance has it.
void keep_result(const std::string& db, std::string_view kind, const std::string& inputs,
                 std::string_view json);

}  // namespace tunnelrig::cli

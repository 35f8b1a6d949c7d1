// gnuplot as a subprocess.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace tunnelrig {

/// Text for gnuplot in single quotes, whatever it holds: in double ones it would run what stands in
/// backquotes. To be drawn with `noenhanced` where it is a user's.
std::string gnuplot_text(std::string_view text);

/// Runs `program` on the script in `folder`, a scratch folder where it leaves files of its own. Returns
/// nothing where it succeeds, else why it did not: not installed, or what it complains of.
std::optional<std::string> run_gnuplot(const std::string& program, const std::filesystem::path& folder,
                                       const std::string& script);

}  // namespace tunnelrig

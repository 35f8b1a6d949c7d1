#include "cli/fly_folder.h"

#include "datasets/csv.h"
#include "datasets/error.h"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFlights = "flights.json";

/// A file that says otherwise could have others removed.
bool is_name(const std::string& text) {
  return !text.empty() && text != "." && text != ".." && fs::path(text).filename() == text;
}

std::vector<std::string> files_of(const nlohmann::json& flight) {
  std::vector<std::string> files = {"comparison.csv"};
  for (const auto& controller : flight.at("controllers")) {
    const auto name = controller.at("name").get<std::string>();
    files.push_back(name + ".csv");
    files.push_back(name + "-residual.csv");
  }
  for (const char* response : kResiduals)
    for (const char* kind : {"residual", "effects"})
      files.push_back(fmt::format("{}-{}.toml", kind, response));
  for (const char* picture : kPictures)
    for (const char* format : {"svg", "png"}) files.push_back(fmt::format("{}.{}", picture, format));
  std::erase_if(files, [](const std::string& file) { return !is_name(file); });
  return files;
}

/// What an earlier call left in `out`, by its flights.json; nothing where none can be read.
std::vector<std::string> files_before(const fs::path& out) {
  std::vector<std::string> files;
  try {
    const auto json = nlohmann::json::parse(read_text(out / kFlights));
    if (json.at("format") != kFlightsFormat) return {};
    const auto& flights = json.at("flights");
    for (const auto& flight : flights) {
      std::string folder;
      if (flights.size() > 1)
        folder =
            scenario_folder(flight.at("tunnel").get<std::string>(), flight.at("scenario").get<std::string>());
      if (!folder.empty() && !is_name(folder)) continue;
      for (const std::string& file : files_of(flight)) files.push_back((fs::path(folder) / file).string());
    }
  } catch (const InputError&) {
    return {};
  } catch (const nlohmann::json::exception&) {
    return {};
  }
  return files;
}

}  // namespace

void FlightsFolder::add(const std::string& folder, const FlownScenario& flown, const FlightTask& task,
                        std::string& warning) {
  staging_.write([&] {
    for (const fs::path& file : write_flown(staging_.path() / folder, flown, task, warning))
      names_.push_back(file.lexically_relative(staging_.path()).string());
  });
}

void FlightsFolder::publish(const std::string& flights_json) {
  staging_.write([&] { write_text(staging_.path() / kFlights, flights_json); });
  names_.emplace_back(kFlights);
  const std::vector<std::string> before = files_before(out_);
  staging_.publish(names_);
  std::error_code error;  // what is in use elsewhere stays
  for (const std::string& file : before) {
    if (std::ranges::count(names_, file) > 0) continue;
    const fs::path path = out_ / file;
    fs::remove(path, error);
    if (const fs::path folder = path.parent_path(); folder != out_ && fs::is_empty(folder, error))
      fs::remove(folder, error);
  }
}

}  // namespace tunnelrig::cli

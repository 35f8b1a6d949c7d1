#include "analysis/exports/export_campaign.h"

#include "analysis/exports/recordings.h"
#include "analysis/exports/tables.h"
#include "analysis/exports/writer.h"
#include "analysis/maps/tunnel_maps.h"
#include "analysis/reduction_output.h"
#include "datasets/error.h"
#include "datasets/output_place.h"
#include "datasets/snapshot.h"
#include "datasets/staged_output.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig::exports {
namespace {

constexpr int kMapNodes = 41;  // as `map` writes

constexpr std::array<std::pair<std::string_view, Format>, 4> kFormats = {
    {{"hdf5", Format::kHdf5}, {"mat", Format::kMat}, {"csv", Format::kCsv}, {"npy", Format::kNpy}}};

struct PartName {
  std::string_view name;
  bool Parts::*part;
};
constexpr std::array<PartName, 5> kParts = {{{"raw", &Parts::raw},
                                             {"thrusts", &Parts::thrusts},
                                             {"coefficients", &Parts::coefficients},
                                             {"maps", &Parts::maps},
                                             {"models", &Parts::models}}};

bool is_folder(Format format) { return format == Format::kCsv || format == Format::kNpy; }

std::unique_ptr<Writer> make_writer(Format format, const std::filesystem::path& path) {
  switch (format) {
    case Format::kHdf5:
      return make_hdf5_writer(path);
    case Format::kMat:
      return make_mat_writer(path);
    case Format::kCsv:
      return make_csv_writer(path);
    case Format::kNpy:
      return make_npy_writer(path);
  }
  return {};
}

/// The campaign file, and the names beside it that SQLite and the recorder look for.
void refuse_campaign_itself(const CampaignFile& file, const std::filesystem::path& target) {
  std::vector<std::filesystem::path> own = files_of_campaign(file.path());
  for (const char* suffix : {".lock", ".part"}) own.emplace_back(file.path().string() + suffix);
  for (const auto& each : own) {
    if (same_place(target, each))
      throw InputError::in(target.string(),
                           "is the campaign file itself, or one that belongs to it; export "
                           "to another name");
  }
}

void append(std::vector<Table>& to, std::vector<Table> from) {
  for (Table& table : from) to.push_back(std::move(table));
}

/// Coefficients and maps, as far as the campaign allows.
void add_results(const CampaignFile& file, const CampaignData& data, const Settings& settings,
                 Contents& contents) {
  if (!settings.parts.coefficients && !settings.parts.maps) return;
  const auto absent = [&](bool wanted, const char* part, const std::string& reason) {
    if (wanted) contents.absent.push_back({part, reason});
  };
  try {
    const Reduction reduction = reduce_by(data, settings.model);
    const Summary summary = summarize_locations(data, reduction);
    contents.provenance.emplace_back("model", reduction.model_name());
    if (settings.parts.coefficients) {
      append(contents.tables, coefficient_tables(data, reduction, summary));
      contents.groups.push_back(covariance_group(summary));
    }
    if (!settings.parts.maps) return;
    try {
      const TunnelMaps maps = fit_maps(map_input(data, summary, file.path().string()));
      const DisturbanceMap map = disturbance_map(maps, kMapNodes, "{}");
      contents.provenance.emplace_back("map_method", map.method);
      contents.tables.push_back(map_locations_table(map));
      contents.groups.push_back(map_group(map));
    } catch (const InputError& error) {
      absent(true, "maps", error.what());
    }
  } catch (const InputError& error) {
    absent(settings.parts.coefficients, "coefficients", error.what());
    absent(settings.parts.maps, "maps", error.what());
  }
}

void add_models(const CampaignFile& file, const CampaignData& data, Contents& contents) {
  if (data.certificate) append(contents.tables, calibration_tables(*data.certificate));
  const std::vector<StoredModel> models = stored_models(file);
  if (models.empty()) {
    contents.absent.push_back({"models", "no effect has been adopted yet (`explain --adopt`)"});
    return;
  }
  append(contents.tables, model_tables(models));
  contents.groups.push_back(model_covariance_group(models));
}

void say_what_calibration_gives(const CampaignData& data, const Parts& parts, Contents& contents) {
  if (data.certificate) return;
  const char* reason = data.raw.empty() ? "the runs give thrusts, not voltages"
                                        : "there is no calibration yet; `tunnelrig calibrate` makes it";
  if (data.raw.empty() && parts.raw) contents.absent.push_back({"raw", reason});
  if (parts.thrusts) contents.absent.push_back({"thrusts", reason});
  if (parts.models) contents.absent.push_back({"calibration", reason});
}

struct Plan {
  Contents contents;
  std::vector<RecordingSource> sources;
};

Plan plan_of(const CampaignFile& file, const Settings& settings) {
  const CampaignData data = read_campaign_data(file);
  const std::vector<RawRun> raw = raw_runs(file);
  Plan plan;
  Contents& contents = plan.contents;
  contents.provenance = {{"format", "tunnelrig-export/1"},
                         {"program", "tunnelrig " + settings.program_version},
                         {"arguments", settings.arguments},
                         {"created_utc", settings.created_utc},
                         {"campaign", data.info.name},
                         {"calibration", data.certificate ? fmt::format("{}", data.certificate_id) : ""},
                         {"calibration_points_hash", data.certificate ? data.certificate->points_hash : ""}};
  plan.sources = recording_sources(file, data, settings.parts, recording_keys(raw), contents.absent);
  std::map<std::string, std::string> keys;  // of what is exported
  for (const RecordingSource& source : plan.sources) {
    contents.recordings.push_back(source.description);
    keys.emplace(source.raw.run, source.description.key);
  }
  contents.tables = {campaign_table(data.info), runs_table(data.runs, keys),
                     recordings_table(file, raw, keys, data.info.daq), lost_frames_table(file, raw, keys),
                     channel_statistics_table(data)};
  say_what_calibration_gives(data, settings.parts, contents);
  add_results(file, data, settings, contents);
  if (settings.parts.models) add_models(file, data, contents);
  contents.tables.push_back(documents_table(file));
  contents.texts = documents_in_force(file);
  contents.tables.push_back(dictionary(contents));
  return plan;
}

void write(const CampaignFile& file, const Plan& plan, Writer& writer, const Progress& progress) {
  stream_recordings(file, plan.sources, writer, progress);
  for (const Table& table : plan.contents.tables) writer.table(table);
  for (const ArrayGroup& group : plan.contents.groups) writer.group(group);
  writer.texts(plan.contents.texts);
  writer.finish(plan.contents.provenance);
}

}  // namespace

Format format_from_name(std::string_view name) {
  for (const auto& [known, format] : kFormats)
    if (known == name) return format;
  throw InputError(fmt::format("'{}' is no format of an export; write folder, hdf5, mat, csv or npy", name));
}

Parts parts_from_names(std::string_view names) {
  if (names.empty()) return {};
  Parts parts{false, false, false, false, false};
  while (!names.empty()) {
    const auto end = names.find(',');
    const std::string_view name = names.substr(0, end);
    const auto* found =
        std::find_if(kParts.begin(), kParts.end(), [&](const PartName& one) { return one.name == name; });
    if (found == kParts.end()) {
      throw InputError(fmt::format(
          "'{}' is no part of an export; write some of raw,thrusts,coefficients,maps,models", name));
    }
    parts.*(found->part) = true;
    names = end == std::string_view::npos ? std::string_view() : names.substr(end + 1);
  }
  return parts;
}

Exported export_campaign(const CampaignFile& file, const std::filesystem::path& target,
                         const Settings& settings, const Progress& progress) {
  const Snapshot snapshot(file);  // what a recorder adds meanwhile is in no part
  refuse_campaign_itself(file, target);
  const auto kind = is_folder(settings.format) ? StagedOutput::Kind::kFolder : StagedOutput::Kind::kFile;
  StagedOutput staged(target, kind);
  const Plan plan = plan_of(file, settings);
  Exported exported{.absent = plan.contents.absent};
  exported.recordings = plan.sources.size();
  for (const RecordingSource& source : plan.sources) {
    exported.frames += source.raw.frames;
    exported.sample_bytes += source.raw.frames * source.raw.format.frame_size();
  }
  staged.write([&] { write(file, plan, *make_writer(settings.format, staged.path()), progress); });
  staged.publish();
  return exported;
}

}  // namespace tunnelrig::exports

#include "cli/live/book.h"

#include "analysis/model/model_store.h"
#include "analysis/reduction.h"
#include "datasets/error.h"
#include "datasets/recorder_lock.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr std::chrono::milliseconds kLook{1000};
constexpr int kShare = 20;  // at most one part in so many of the time is spent reading

/// What the maps depend on: they are fitted anew only where it changes.
std::string fingerprint(const Reduction& reduction) {
  double sum = 0;
  for (const RunCoefficients& run : reduction.runs)
    sum += static_cast<double>(run.run + 1) * run.c_t + run.u_percent;
  return fmt::format("{} {:.17g} {}", reduction.runs.size(), sum, reduction.model_name());
}

std::string unreadable_json(const std::string& reason) {
  const Json json{{"locations", Json::array()},
                  {"runs", Json::array()},
                  {"maps", nullptr},
                  {"maps_reason", "the campaign cannot be read: " + reason}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

CellKnowledge cells_of(const CampaignData& data) {
  CellKnowledge cells;
  if (data.certificate) {
    cells.cells.emplace();
    for (int rotor = 0; rotor < data.info.rig.rotors; ++rotor) {
      const CellFit& fit = data.certificate->cells.at(static_cast<std::size_t>(rotor));
      const ForceReading force = data.certificate->force(rotor + 1, 0);
      (*cells.cells)[static_cast<std::size_t>(rotor)] = {
          force.d_voltage_N_per_V / data.certificate->propellers.factor(rotor), fit.zero_V};
    }
  }
  for (const std::size_t r : recorded_runs(data, RunKind::kTare)) {
    const Run& run = data.runs[r];
    const RunStatistics& statistics = data.statistics.at(run.run);
    const auto before = cells.tares.find(run.session);
    CellKnowledge::Tare tare;
    const auto source = run.labels.find("source");
    tare.simulated = source != run.labels.end() && source->second.starts_with("virtual");
    tare.end_s = run.start_s + statistics.elapsed_s(data.info.daq.sample_rate_hz);
    const auto rotors = static_cast<std::size_t>(data.info.rig.rotors);
    for (std::size_t c = 0; c < std::min(rotors, statistics.channels.size()); ++c) {
      tare.mean_V[c] = statistics.channels[c].mean_V;
      if (before == cells.tares.end()) continue;
      const double drift_V = tare.mean_V[c] - before->second.mean_V[c];
      if (tare.drift_rotor != 0 && std::abs(drift_V) <= std::abs(tare.drift_V)) continue;
      tare.drift_V = drift_V;
      tare.drift_rotor = static_cast<int>(c) + 1;
    }
    cells.tares[run.session] = tare;
  }
  return cells;
}

Book::Book(BookSettings settings, Viewers& viewers, LiveFeed& feed)
    : settings_(std::move(settings)), viewers_(viewers), feed_(feed), thread_([this] { work(); }) {}

Book::~Book() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

void Book::look() {
  const std::lock_guard lock(mutex_);
  asked_ = true;
  wake_.notify_all();
}

void Book::work() {
  lower_priority(15);
  std::optional<CampaignFile> file;
  Clock::duration pause = kLook;
  bool failed = false;
  while (true) {
    bool asked = false;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, pause, [&] { return asked_ || stopping_; });
      if (stopping_) return;
      asked = std::exchange(asked_, false);
    }
    // Without the lock: `look` is called on the recording thread, which must not wait for a read of the file.
    if (!asked && !failed && !changed(*file)) continue;
    const auto begin = Clock::now();
    try {
      if (!file) file.emplace(settings_.campaign, CampaignFile::Access::kRead);
      read(*file);
      failed = false;
    } catch (const std::exception& error) {  // of a file that another program is changing, or has broken
      viewers_.tell("campaign", unreadable_json(error.what()));
      failed = true;  // and tries again
    }
    pause = std::max<Clock::duration>(kLook, kShare * (Clock::now() - begin));
  }
}

/// While this process records, the file changes at every commit; a new certificate is all that others add.
bool Book::changed(CampaignFile& file) {
  try {
    if (settings_.follow) return file.data_version() != version_;
    const auto certificate = file.newest_document("calibration");
    return certificate && certificate->id != certificate_;
  } catch (const StorageError&) {
    return false;
  }
}

void Book::read_losses(CampaignFile& file, const CampaignData& data) {
  for (const auto& [name, raw] : data.raw) {
    if (lost_.contains(name) && raw.state != RunState::kRecording) continue;
    const auto ledger = ledger_of(file, raw.id);
    if (!ledger) continue;
    if (raw.state == RunState::kRecording)
      lost_.erase(name);
    else
      lost_[name] = ledger->frames_lost;
  }
}

void Book::read(CampaignFile& file) {
  version_ = file.data_version();
  const CampaignData data = read_campaign_data(file);
  certificate_ = data.certificate ? data.certificate_id : -1;
  feed_.know(cells_of(data));
  read_losses(file, data);
  if (settings_.follow) follow(file, data);

  CampaignStand stand{.data = &data, .lost = lost_, .plan = settings_.plan, .position = feed_.position()};
  std::optional<Reduction> reduction;
  std::string reason;
  try {
    reduction = reduce_by(data, choose_model(file, "", ""));
    stand.reduction = &*reduction;
  } catch (const InputError& error) {
    reason = error.what();
  }
  const auto tell = [&] {
    stand.maps = maps_;
    stand.maps_reason = maps_reason_;
    viewers_.tell("campaign", campaign_json(stand));
  };
  const std::string made_of = reduction ? fingerprint(*reduction) : reason;
  if (made_of == maps_of_) return tell();
  tell();  // runs and locations at once, the maps when they are fitted
  maps_of_ = made_of;
  try {
    if (!reduction) throw InputError(reason);
    maps_ = maps_json(data, *reduction);
    maps_reason_.clear();
  } catch (const std::exception& error) {
    maps_ = "null";
    maps_reason_ = error.what();
  }
  tell();
}

/// Of a campaign that another process records: which run is under way, and its ledger so far.
void Book::follow(CampaignFile& file, const CampaignData& data) {
  Position position;
  std::optional<Ledger> ledger;
  const bool recorded = recorder_of(settings_.campaign).has_value();
  if (!data.runs.empty()) {
    const Run& run = data.runs.back();
    position.run = {.run = run.run,
                    .location = run.location,
                    .session = run.session,
                    .repeat = run.repeat,
                    .kind = run.kind};
    const auto raw = data.raw.find(run.run);
    if (raw != data.raw.end()) {
      ledger = ledger_of(file, raw->second.id);
      position.run.duration_s = static_cast<double>(raw->second.frames) / data.info.daq.sample_rate_hz;
      if (recorded && raw->second.state == RunState::kRecording) position.phase = Phase::kRecording;
    }
  }
  feed_.follow(position, ledger);
}

}  // namespace tunnelrig::live

#include "analysis/campaign_data.h"

#include "analysis/run_summary.h"
#include "datasets/error.h"
#include "datasets/in_threads.h"
#include "datasets/statistics_store.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <set>

namespace tunnelrig {
namespace {

constexpr int kThreads = 2;

/// The same sums in the same order give the same numbers to the last bits; what differs more was not computed
/// from these data.
constexpr double kSameNumber = 1e-9;

bool same(double a, double b) {
  return std::abs(a - b) <= kSameNumber * std::max({std::abs(a), std::abs(b), 1e-12});
}

RunStatistics summarize(const CampaignFile& file, const CampaignInfo& info, const RawRun& run,
                        bool with_spectrum) {
  const auto summarizer = make_run_summarizer(info, run.format, with_spectrum);
  read_raw(file, run, *summarizer);
  return summarizer->finish(run.hash);
}

/// Adds their windows to the statistics of those runs.
void read_windows_of(const CampaignFile& file, const std::set<std::string>& runs, CampaignData& data) {
  std::map<std::int64_t, RunStatistics> with_windows;
  for (const std::string& name : runs)
    if (const auto raw = data.raw.find(name); raw != data.raw.end() && data.statistics.contains(name))
      with_windows[raw->second.id];
  read_windows(file, with_windows);
  for (const std::string& name : runs) {
    const auto raw = data.raw.find(name);
    const auto found = raw == data.raw.end() ? with_windows.end() : with_windows.find(raw->second.id);
    if (found == with_windows.end()) continue;
    data.statistics[name].window_s = found->second.window_s;
    data.statistics[name].window_means_V = std::move(found->second.window_means_V);
  }
}

}  // namespace

CampaignData read_campaign_data(const CampaignFile& file) {
  CampaignData data;
  data.info = file.info();
  data.runs = file.runs();
  auto statistics = all_statistics(file);
  for (RawRun& raw : raw_runs(file)) {
    if (const auto found = statistics.find(raw.id); found != statistics.end()) {
      data.statistics.emplace(raw.run, std::move(found->second));
    }
    data.raw.emplace(raw.run, std::move(raw));
  }
  std::set<std::string> tares;  // what they leave of slow noise is in every run's zero
  for (const Run& run : data.runs)
    if (run.kind == RunKind::kTare) tares.insert(run.run);
  read_windows_of(file, tares, data);
  if (const auto document = file.newest_document("calibration")) {
    data.certificate = certificate_from_json(document->json);
    data.certificate_id = document->id;
  }
  return data;
}

void read_run_windows(const CampaignFile& file, CampaignData& data) {
  std::set<std::string> all;
  for (const auto& [name, statistics] : data.statistics) all.insert(name);
  read_windows_of(file, all, data);
}

std::map<std::string, RunStatistics> statistics_from_raw(
    const std::filesystem::path& path, bool with_spectrum,
    const std::function<void(std::size_t, std::size_t)>& progress) {
  const CampaignFile overview(path, CampaignFile::Access::kRead);
  const CampaignInfo info = overview.info();
  std::vector<RawRun> runs = raw_runs(overview);
  std::erase_if(runs, [](const RawRun& run) { return run.frames == 0; });
  std::map<std::string, std::optional<double>> speed_rpm;
  for (const Run& run : overview.runs()) speed_rpm[run.run] = run.number("speed_rpm");

  std::map<std::string, RunStatistics> statistics;
  std::mutex mutex;  // guards statistics, failure and progress
  std::exception_ptr failure;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    try {
      const CampaignFile file(path, CampaignFile::Access::kRead);
      for (std::size_t i = next++; i < runs.size(); i = next++) {
        const auto speed = speed_rpm.find(runs[i].run);
        RunStatistics result = summarize(
            file, speed == speed_rpm.end() ? info : at_speed(info, speed->second), runs[i], with_spectrum);
        const std::lock_guard lock(mutex);
        statistics.emplace(runs[i].run, std::move(result));
        if (progress) progress(statistics.size(), runs.size());
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
      next = runs.size();
    }
  };
  in_threads(kThreads, work);
  if (failure) std::rethrow_exception(failure);
  return statistics;
}

std::vector<std::string> disagreements(const std::map<std::string, RunStatistics>& stored,
                                       const std::map<std::string, RunStatistics>& computed) {
  std::vector<std::string> lines;
  for (const auto& [run, now] : computed) {
    const auto found = stored.find(run);
    if (found == stored.end()) {
      lines.push_back(fmt::format("run {}: no statistics are stored", run));
      continue;
    }
    const RunStatistics& then = found->second;
    if (then.hash != now.hash)
      lines.push_back(fmt::format("run {}: the stored statistics are of other raw data", run));
    for (std::size_t c = 0; c < std::min(then.channels.size(), now.channels.size()); ++c) {
      const ChannelStatistics &a = then.channels[c], &b = now.channels[c];
      if (!same(a.mean_V, b.mean_V) || !same(a.std_V, b.std_V) ||
          !same(a.standard_error_V, b.standard_error_V)) {
        lines.push_back(fmt::format(
            "run {}, channel {}: stored mean {:.9g} V and deviation {:.9g} V, from raw {:.9g} V and {:.9g} V",
            run, c + 1, a.mean_V, a.std_V, b.mean_V, b.std_V));
      }
    }
  }
  return lines;
}

}  // namespace tunnelrig

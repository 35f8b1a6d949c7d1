#include "analysis/health.h"

#include "analysis/findings.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

namespace tunnelrig {
namespace {

constexpr double kMuchLost = 0.01;  // share of a run's frames

class Examination : public Findings {
 public:
  Examination(const CampaignFile& file, const CampaignData& data) : file_(file), data_(data) {
    for (const Run& run : data.runs)
      if (!run.excluded.empty()) excluded_.insert(run.run);
  }

  void integrity() {
    const std::string problems = file_.integrity_problems();
    if (problems.empty())
      good("data base", "SQLite finds nothing wrong");
    else
      problem("data base", problems,
              "restore the file from a copy; `tunnelrig export` saves what can still be read");
  }

  void raw_data(const std::function<void(std::size_t, std::size_t)>& progress) {
    Names damaged, changed, alike;
    std::map<std::string, std::string> first;  // run of each hash
    std::size_t done = 0;
    for (const auto& [name, run] : data_.raw) {
      const auto [hash, is_damaged] = hash_of_raw(file_, run);
      if (is_damaged) {
        damaged.add(name);
      } else {
        if (!run.hash.empty() && hash != run.hash) changed.add(name);
        if (!excluded_.contains(name)) {
          const auto [known, fresh] = first.emplace(hash, name);
          if (!fresh && run.frames > 0) alike.add(fmt::format("{} and {}", known->second, name));
        }
      }
      if (progress) progress(++done, data_.raw.size());
    }
    if (!damaged.empty())
      problem("raw data", "damaged blobs in " + damaged.text(),
              "restore the file from a copy, or record these runs again");
    if (!changed.empty())
      problem("raw data", "not what was recorded: " + changed.text(), "restore the file from a copy");
    if (!alike.empty())
      problem("raw data", "the same frames in " + alike.text(),
              "one recording counts twice: correct `raw` in runs.csv, or exclude one of them");
    if (damaged.empty() && changed.empty() && alike.empty())
      good("raw data", fmt::format("{} runs, every blob has its checksum", data_.raw.size()));
  }

  void states() {
    Names interrupted, partial, missing;
    for (const Run& run : data_.runs) {
      const auto raw = data_.raw.find(run.run);
      if (raw == data_.raw.end()) {
        if (!run.raw.empty()) missing.add(run.run);
      } else if (raw->second.state == RunState::kRecording) {
        interrupted.add(run.run);
      } else if (raw->second.state == RunState::kPartial) {
        partial.add(run.run);
      }
    }
    if (!interrupted.empty())
      note("recordings", "under way, or cut off by a kill: " + interrupted.text(),
           "the next `tunnelrig log` marks what was cut off as partial");
    if (!partial.empty())
      note("recordings", "partial, left out of the reduction: " + partial.text(),
           "record them again (`tunnelrig log --plan` does)");
    if (!missing.empty())
      problem("recordings", "without the raw data that their row names: " + missing.text(),
              "import the campaign again");
    if (interrupted.empty() && partial.empty() && missing.empty())
      good("recordings", "every run is complete");
  }

  void marks() {
    Names excluded, alarmed;
    for (const Run& run : data_.runs) {
      if (!run.excluded.empty())
        excluded.add(fmt::format("{} ({})", run.run, run.excluded));
      else if (!run.alarms.empty())
        alarmed.add(fmt::format("{} ({})", run.run, run.alarms));
    }
    if (!excluded.empty())
      note("exclusions", "kept, and left out of what is derived: " + excluded.text(),
           "`tunnelrig serve` shows their notes; the live page of `log` takes them in again");
    if (!alarmed.empty())
      note("alarms", "while recording: " + alarmed.text(), "look at these runs; redo or exclude them");
  }

  void ledgers() {
    Names open, lossy, much, refused, again;
    std::uint64_t lost = 0, emitted = 0;
    for (const auto& [name, run] : data_.raw) {
      const auto ledger = ledger_of(file_, run.id);
      std::uint64_t in_gaps = 0;
      for (const Gap& gap : gaps_of(file_, run.id)) in_gaps += gap.frames_lost;
      if (ledger &&
          (!ledger->closed() || ledger->frames_stored != run.frames || ledger->frames_lost != in_gaps))
        open.add(name);
      if (ledger && ledger->packets_corrupt > 0)
        refused.add(fmt::format("{} ({})", name, ledger->packets_corrupt));
      if (ledger && much_came_again(*ledger))
        again.add(fmt::format("{} ({})", name, ledger->frames_duplicate));
      // Of an imported run the gaps are all that is known.
      const std::uint64_t run_lost = ledger ? ledger->frames_lost : in_gaps;
      const std::uint64_t run_emitted = ledger ? ledger->frames_emitted : run.frames + in_gaps;
      lost += run_lost;
      emitted += run_emitted;
      if (run_lost > 0) lossy.add(name);
      if (static_cast<double>(run_lost) > kMuchLost * static_cast<double>(run_emitted)) much.add(name);
    }
    if (!open.empty())
      problem("loss ledger", "emitted is not stored plus lost in " + open.text(),
              "do not trust these runs; record them again");
    if (!much.empty())
      problem("losses", "more than 1 % of the frames lost in " + much.text(),
              "check cable, hub and disk; record them again");
    else if (!lossy.empty())
      note("losses", fmt::format("{} of {} frames, in {}", lost, emitted, lossy.text()), "");
    if (!refused.empty())
      note("packets", "refused: " + refused.text(),
           "their checksums are wrong, or their numbers are not believed: check cable and firmware");
    if (!again.empty())
      note("packets", "frames under numbers that had passed, dropped: " + again.text(),
           "the link sends twice, or the board restarts without a new boot id (docs/wire-format.md)");
    if (open.empty() && lossy.empty()) good("loss ledger", "closed for every run, nothing lost");
  }

 private:
  const CampaignFile& file_;
  const CampaignData& data_;
  std::set<std::string> excluded_;  // runs; nothing is derived from them
};

}  // namespace

std::vector<Finding> examine(const CampaignFile& file, const CampaignData& data,
                             const std::function<void(std::size_t, std::size_t)>& progress) {
  Examination examination(file, data);
  examination.integrity();
  examination.raw_data(progress);
  examination.states();
  examination.marks();
  examination.ledgers();
  std::vector<Finding> findings = examination.take();
  std::ranges::move(fitness(file, data), std::back_inserter(findings));
  return findings;
}

}  // namespace tunnelrig

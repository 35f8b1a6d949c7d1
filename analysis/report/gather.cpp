// What sections and figures are made from: a campaign file, reduced and mapped as far as it allows.
#include "analysis/reduction_output.h"
#include "analysis/report/sections.h"
#include "datasets/error.h"

#include <utility>

namespace tunnelrig::report {
namespace {

// Finer than the grid of `map`, so that the page's lines are smooth; with a column at ȳ = 0, where it changes
// from the measured to the mirrored half.
constexpr int kNodes = 61;

Frames frames_of(const CampaignFile& file, const RawRun& run) {
  if (const auto ledger = ledger_of(file, run.id)) return {ledger->frames_emitted, ledger->frames_lost};
  Frames frames{.emitted = run.frames};
  for (const Gap& gap : gaps_of(file, run.id)) frames.lost += gap.frames_lost;
  frames.emitted += frames.lost;
  return frames;
}

/// Reduces and maps as far as the campaign allows, and keeps the reason where it does not.
void derive(Material& material) {
  try {
    material.reduction = reduce_by(material.data, material.settings.model);
    material.summary = summarize_locations(material.data, *material.reduction);
  } catch (const InputError& error) {
    material.reduction.reset();
    material.not_reduced = error.what();
    material.not_mapped = error.what();
    return;
  }
  try {
    material.fitted = fit_maps(map_input(material.data, *material.summary, material.settings.db));
    material.map = disturbance_map(*material.fitted, kNodes, "{}");
  } catch (const InputError& error) {
    material.not_mapped = error.what();
  }
}

}  // namespace

Material gather(const CampaignFile& file, const ReportSettings& settings) {
  Material material{.file = file, .settings = settings, .data = read_campaign_data(file)};
  if (material.data.runs.empty() && !material.data.certificate) {
    throw InputError::in(settings.db, "holds no runs and no calibration yet, so there is nothing to report");
  }
  derive(material);
  for (const Run& run : material.data.runs) {
    const auto raw = material.data.raw.find(run.run);
    material.frames.push_back(raw == material.data.raw.end() ? Frames{} : frames_of(file, raw->second));
  }
  return material;
}

}  // namespace tunnelrig::report

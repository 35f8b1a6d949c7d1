// What is computed of a run's raw data while it passes: means with honest errors, windows, spectrum.
#pragma once

#include "datasets/campaign.h"
#include "datasets/run_summarizer.h"

#include <memory>

namespace tunnelrig {

/// Sums a run up in one pass (memory: the windows of the run). Voltages; see RunStatistics.
/// docs/run-statistics.md.
///
/// - standard error of the mean: from the means of blocks of about 50 ms by Geyer's initial positive
/// sequence, so that
///   turbulence that lasts longer than a sample is not taken for independent samples
/// - spectrum: Welch's method, Hann windows of 4096 frames, half overlapped; lines above their surroundings,
/// named where
///   they lie at the shaft's or the mains' frequency or an alias of it
/// `with_spectrum` false leaves the lines and the shaft's frequency out.
std::unique_ptr<RunSummarizer> make_run_summarizer(const CampaignInfo& campaign, const RawFormat& format,
                                                   bool with_spectrum = true);

}  // namespace tunnelrig

// What people and the recorder say of a run after it began: excluded, notes, alarms. Columns of the sheet of
// runs, so that they travel with it; no run is ever deleted.
#pragma once

#include "datasets/campaign_file.h"

#include <string>
#include <string_view>

namespace tunnelrig {

/// Leaves a run out of everything that is derived. Throws InputError for an unknown run or an empty reason.
void exclude_run(CampaignFile& file, std::string_view run, std::string_view reason);

/// Takes an excluded run in again; a note keeps why it had been excluded. Throws InputError for an unknown
/// run and for one that is not excluded.
void include_run(CampaignFile& file, std::string_view run);

/// Adds a line to a run's notes. Throws InputError for an unknown run or an empty text.
void add_note(CampaignFile& file, std::string_view run, std::string_view text);

/// Marks a run with the alarms that it had, "clipping;loss"; empty: none. False at once, and nothing done,
/// where another connection is writing to the file.
bool mark_alarms(CampaignFile& file, std::string_view run, std::string_view alarms);

/// A text that fits a cell and a line: control characters become blanks, at most 500 bytes (whole
/// characters), trimmed.
std::string one_line(std::string_view text);

}  // namespace tunnelrig

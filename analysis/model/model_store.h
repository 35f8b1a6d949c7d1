// Versions of the model in a campaign file, and the one that a reduction goes by.
#pragma once

#include "analysis/model/model_version.h"
#include "analysis/reduction.h"
#include "datasets/campaign_file.h"

#include <optional>

namespace tunnelrig {

struct StoredModel {
  ModelVersion model;
  std::int64_t document = 0;
  std::string created_utc;
  Provenance provenance;
};

/// All versions, oldest first, without the thesis's. Throws InputError naming the document that is broken.
std::vector<StoredModel> stored_models(const CampaignFile& file);

/// Stores a model as the next version, which it returns.
int store_model(CampaignFile& file, ModelVersion model, const Provenance& provenance);

/// Whether two correct alike, to four digits: effects, parameters and curves, whatever explanation they are
/// of.
bool corrects_alike(const ModelVersion& one, const ModelVersion& other);

/// What a reduction goes by: the thesis's model with some terms switched on, or an adopted version.
struct ModelChoice {
  ModelTerms terms;
  std::optional<ModelVersion> version;

  /// "thesis", "air_pressure+rotor_speed", or "version 2 (creep of rotor 1)"
  std::string name() const { return version ? version->name() : terms.name(); }
};

/// `model`: "thesis", a version's number, "latest" (the thesis's where none is stored), or empty: latest,
/// unless `terms` are given, which stand on the thesis's model. Throws InputError for a version that is not
/// stored, and for terms on top of one.
ModelChoice choose_model(const CampaignFile& file, const std::string& model, const std::string& terms);

/// `reduce_runs`, then `apply_model` where a version was chosen.
Reduction reduce_by(const CampaignData& data, const ModelChoice& choice);

}  // namespace tunnelrig

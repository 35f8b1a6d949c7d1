#include "analysis/model/model_store.h"

#include "analysis/model/apply_model.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <nlohmann/json.hpp>

namespace tunnelrig {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKind = "model";

std::string versions_in_words(const std::vector<StoredModel>& stored) {
  std::string text = "thesis";
  for (const StoredModel& one : stored) text += fmt::format(", {}", one.model.version);
  return text;
}

int version_from(const std::string& text) {
  int version = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), version);
  if (error != std::errc() || end != text.data() + text.size() || version < 0)
    throw InputError(fmt::format("--model {}: write thesis, latest or the number of a version", text));
  return version;
}

/// Another build of the program rounds otherwise.
bool is_nearly(const Json& one, const Json& other) {
  constexpr double kSame = 1e-4;
  if (one.is_number() && other.is_number()) {
    const double a = one.get<double>(), b = other.get<double>();
    return std::abs(a - b) <= kSame * std::max(std::abs(a), std::abs(b));
  }
  if (!one.is_structured() || one.type() != other.type()) return one == other;
  return one.size() == other.size() && std::equal(one.begin(), one.end(), other.begin(), is_nearly);
}

}  // namespace

std::vector<StoredModel> stored_models(const CampaignFile& file) {
  std::vector<StoredModel> stored;
  for (const Document& document : file.documents(kKind)) {
    const std::string source =
        fmt::format("{}: the stored model (document {})", file.path().string(), document.id);
    stored.push_back(
        {model_from_json(document.json, source), document.id, document.created_utc, document.provenance});
    const auto version = static_cast<int>(stored.size());
    if (stored.back().model.version != version)
      throw InputError(fmt::format("{} says that it is version {}, and it is the {}. that is stored", source,
                                   stored.back().model.version, version));
  }
  return stored;
}

int store_model(CampaignFile& file, ModelVersion model, const Provenance& provenance) {
  file.atomically([&] {
    model.version = static_cast<int>(stored_models(file).size()) + 1;
    file.add_document(kKind, provenance, model_json(model));
  });
  return model.version;
}

bool corrects_alike(const ModelVersion& one, const ModelVersion& other) {
  const Json a = Json::parse(model_json(one)), b = Json::parse(model_json(other));
  return std::ranges::all_of(std::array{"baseline", "multiplicative", "terms", "curves"},
                             [&](const char* key) { return is_nearly(a[key], b[key]); });
}

ModelChoice choose_model(const CampaignFile& file, const std::string& model, const std::string& terms) {
  ModelChoice choice{terms_from_names(terms), {}};
  if (model == "thesis" || (model.empty() && !terms.empty())) return choice;
  std::vector<StoredModel> stored;
  if (model.empty() || model == "latest") {
    stored = stored_models(file);
    if (stored.empty()) return choice;
    choice.version = std::move(stored.back().model);
  } else {
    const int version = version_from(model);
    if (version == 0) return choice;
    stored = stored_models(file);
    if (static_cast<std::size_t>(version) > stored.size())
      throw InputError(
          fmt::format("--model {}: {} has {}", model, file.path().string(), versions_in_words(stored)));
    choice.version = std::move(stored[static_cast<std::size_t>(version - 1)].model);
  }
  if (choice.terms.name() != "thesis")
    throw InputError(fmt::format("--with {} stands on the thesis's model only: write --model thesis with it",
                                 choice.terms.name()));
  return choice;
}

Reduction reduce_by(const CampaignData& data, const ModelChoice& choice) {
  const Reduction thesis = reduce_runs(data, choice.terms);
  return choice.version ? apply_model(data, thesis, *choice.version) : thesis;
}

}  // namespace tunnelrig

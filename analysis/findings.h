// What the doctor's checks have in common. Private to health.cpp and fitness.cpp.
#pragma once

#include "analysis/health.h"
#include "datasets/first_few.h"

#include <string>
#include <utility>
#include <vector>

namespace tunnelrig {

/// Collects names and says them in a sentence's length.
class Names {
 public:
  Names() = default;
  explicit Names(std::vector<std::string> names) : names_(std::move(names)) {}

  void add(const std::string& name) { names_.push_back(name); }
  bool empty() const { return names_.empty(); }
  std::size_t size() const { return names_.size(); }
  std::string text() const { return first_few(names_, kMost); }

 private:
  static constexpr std::size_t kMost = 6;  // before a finding says how many more there are

  std::vector<std::string> names_;
};

/// Collects findings.
class Findings {
 public:
  std::vector<Finding> take() { return std::move(findings_); }

 protected:
  void good(const std::string& check, const std::string& found) {
    findings_.push_back({Severity::kGood, check, found, ""});
  }
  void note(const std::string& check, const std::string& found, const std::string& advice) {
    findings_.push_back({Severity::kNote, check, found, advice});
  }
  void problem(const std::string& check, const std::string& found, const std::string& advice) {
    findings_.push_back({Severity::kProblem, check, found, advice});
  }
  void add(Finding finding) { findings_.push_back(std::move(finding)); }

 private:
  std::vector<Finding> findings_;
};

/// Whether the campaign is fit to be reduced and mapped, which supposes that the file is whole.
std::vector<Finding> fitness(const CampaignFile& file, const CampaignData& data);

}  // namespace tunnelrig

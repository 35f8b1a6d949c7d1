// What was derived, as the campaign file keeps it.
#include "datasets/campaign_file.h"
#include "datasets/sqlite.h"

namespace tunnelrig {
namespace {

/// Of a row of what both statements below select.
Document document_of(const Statement& select, std::string_view kind) {
  return {.id = select.integer(0),
          .kind = std::string(kind),
          .created_utc = select.text(1),
          .provenance = {select.text(2), select.text(3), select.text(4)},
          .json = select.text(5)};
}

}  // namespace

std::int64_t CampaignFile::add_document(std::string_view kind, const Provenance& provenance,
                                        std::string_view json) {
  Statement(*database_,
            "INSERT INTO documents (kind, created_utc, program_version, arguments, inputs, document) "
            "VALUES (?, ?, ?, ?, ?, ?)")
      .bind(kind)
      .bind(format_utc(utc_seconds()))
      .bind(provenance.program_version)
      .bind(provenance.arguments)
      .bind(provenance.inputs)
      .bind(json)
      .run();
  return database_->last_id();
}

std::vector<Document> CampaignFile::documents(std::string_view kind) const {
  Statement select(*database_,
                   "SELECT id, created_utc, program_version, arguments, inputs, document "
                   "FROM documents WHERE kind = ? ORDER BY id");
  select.bind(kind);
  std::vector<Document> found;
  while (select.step()) found.push_back(document_of(select, kind));
  return found;
}

std::optional<Document> CampaignFile::newest_document(std::string_view kind) const {
  Statement select(*database_,
                   "SELECT id, created_utc, program_version, arguments, inputs, document "
                   "FROM documents WHERE kind = ? ORDER BY id DESC LIMIT 1");
  select.bind(kind);
  if (!select.step()) return {};
  return document_of(select, kind);
}

}  // namespace tunnelrig

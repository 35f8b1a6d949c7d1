// The seam between what is exported and how it is written: four formats, each in a file of its own.
#pragma once

#include "analysis/exports/contents.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace tunnelrig::exports {

/// Some consecutive frames of a recording: the bytes of each of its series, in their order.
struct Block {
  std::size_t frames = 0;
  std::vector<std::span<const std::byte>> series;
};

/// Writes one export. Calls come in the order begin, block …, end for each recording, then tables, groups and
/// texts, then finish. Throws InputError naming the file where it cannot be written, at the latest by
/// `finish`, after which all is on its way to the disk.
class Writer {
 public:
  Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  virtual ~Writer() = default;

  virtual void begin(const Recording& recording) = 0;
  virtual void block(const Block& block) = 0;
  virtual void end() = 0;
  virtual void table(const Table& table) = 0;
  virtual void group(const ArrayGroup& group) = 0;
  virtual void texts(const std::vector<Attachment>& texts) = 0;
  virtual void finish(const std::vector<std::pair<std::string, std::string>>& provenance) = 0;
};

/// HDF5 1.10 in one file, MATLAB level 5 in one file, CSV and .npy in a folder that is there already.
std::unique_ptr<Writer> make_hdf5_writer(const std::filesystem::path& file);
std::unique_ptr<Writer> make_mat_writer(const std::filesystem::path& file);
std::unique_ptr<Writer> make_csv_writer(const std::filesystem::path& folder);
std::unique_ptr<Writer> make_npy_writer(const std::filesystem::path& folder);

}  // namespace tunnelrig::exports

// A file that is written from start to end, every byte of it checked. Private to exports/.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tunnelrig::exports {

/// All methods throw InputError naming the file where the disk is full or fails.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }

  /// What was written is with the system now; nothing may be written afterwards.
  void close();

 private:
  void flush();
  void write_out(std::span<const std::byte> bytes);

  std::string name_;
  int fd_ = -1;
  std::vector<std::byte> buffer_;
};

/// A whole file.
void write_file(const std::filesystem::path& path, std::string_view text);

/// Throws an InputError that says what errno does.
[[noreturn]] void fail_to_write(const std::string& name);

}  // namespace tunnelrig::exports

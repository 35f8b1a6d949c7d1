// The two exceptions that the program turns into a message: input that a person can mend, and storage.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace tunnelrig {

/// Bad input. The message names the file, the line or value, and the rule that it broke; the program
/// prints it and exits with 2. Thrown at the boundary only: inside, a broken rule is a bug.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}

  template <typename... Args>
  static InputError at(const std::string& file, int line, fmt::format_string<Args...> rule, Args&&... args) {
    return InputError(fmt::format("{}:{}: {}", file, line, fmt::format(rule, std::forward<Args>(args)...)));
  }

  template <typename... Args>
  static InputError in(const std::string& file, fmt::format_string<Args...> rule, Args&&... args) {
    return InputError(fmt::format("{}: {}", file, fmt::format(rule, std::forward<Args>(args)...)));
  }
};

/// The campaign file cannot be read or written: a full disk, a damaged file, another writer.
class StorageError : public std::runtime_error {
 public:
  StorageError(const std::string& message, bool disk_full)
      : std::runtime_error(message), disk_full_(disk_full) {}
  bool disk_full() const { return disk_full_; }

 private:
  bool disk_full_;
};

}  // namespace tunnelrig

#pragma once

#include "datasets/error.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace tunnelrig::fuzz {

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

inline std::span<const std::byte> as_bytes(const std::uint8_t* data, std::size_t size) {
  return std::as_bytes(std::span(data, size));
}

/// Runs a parser. An InputError is an answer; anything else that it throws is a finding.
template <typename Call>
void expect_answer(Call call) {
  try {
    call();
  } catch (const InputError&) {
  }
}

}  // namespace tunnelrig::fuzz

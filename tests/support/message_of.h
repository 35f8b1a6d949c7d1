#pragma once

#include "datasets/error.h"

#include <functional>
#include <string>

namespace tunnelrig::test {

/// What the InputError says that `call` throws, or that it threw none.
inline std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no InputError was thrown";
}

}  // namespace tunnelrig::test

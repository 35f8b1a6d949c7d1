#include "bench/stand_in_ioctl.h"

#include <atomic>
#include <cstdarg>
#include <cstdint>
#include <ctime>

#include <dlfcn.h>
#include <sys/ioctl.h>

namespace {

std::atomic<std::int64_t> spent_ns{0};

std::int64_t thread_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

// The program's own ioctl() comes before umockdev's in the search for the name; it times that and passes on.
extern "C" int ioctl(int file, unsigned long request, ...) noexcept {
  using Ioctl = int (*)(int, unsigned long, ...);
  static const auto next = reinterpret_cast<Ioctl>(::dlsym(RTLD_NEXT, "ioctl"));
  std::va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  const std::int64_t began_ns = thread_ns();
  const int result = next(file, request, argument);
  spent_ns.fetch_add(thread_ns() - began_ns, std::memory_order_relaxed);
  return result;
}

namespace tunnelrig {

double ioctl_processor_s() { return 1e-9 * static_cast<double>(spent_ns.load(std::memory_order_relaxed)); }

}  // namespace tunnelrig

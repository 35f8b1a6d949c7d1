// Any bytes as a request to the live page: it gets an answer, and what is not asked for with the token is
// never carried out. Lines are the request's fields; the rest is its body. A first byte of ours makes host
// and token right, so that what stands behind them is reached.
#include "cli/live/site.h"
#include "fuzz/input.h"

#include <cstdlib>
#include <string>

namespace {

using namespace tunnelrig::live;

constexpr std::string_view kToken = "0123456789abcdef0123456789abcdef";

std::string_view line(std::string_view& text) {
  const auto end = text.find('\n');
  const std::string_view first = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return first;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text = tunnelrig::fuzz::as_text(data, size);
  const char mode = text.empty() ? '\0' : text[0];
  const bool open = (mode & 1) != 0, guided = (mode & 2) != 0;
  if (!text.empty()) text.remove_prefix(1);
  bool carried_out = false;
  const Site site({.address = "127.0.0.1",
                   .port = 8266,
                   .open = open,
                   .host_name = "rig-pc",
                   .token = std::string(kToken),
                   .page = "{{nonce}} {{token}}"},
                  [&](const Command& command) {
                    carried_out = true;
                    if (command.token != kToken) std::abort();
                    return CommandResult{command.text, command.name};
                  });
  SiteRequest request;
  request.method = line(text);
  request.target = line(text);
  for (std::string* field : {&request.host, &request.origin, &request.fetch_site, &request.content_type,
                             &request.content_encoding, &request.transfer_encoding, &request.range})
    *field = line(text);
  request.body = text;
  if (guided) {
    request.host = "127.0.0.1:8266";
    if (open) request.target += "?token=" + std::string(kToken);
    if (request.body.starts_with('{'))
      request.body = "{\"token\":\"" + std::string(kToken) + "\"," + request.body.substr(1);
  }
  const SiteAnswer answer = site.answer(request);
  if (answer.status < 200 || answer.status > 599) std::abort();
  if (carried_out && request.method != "POST") std::abort();
  // the token leaves the program in the page alone
  const bool page = answer.status == 200 && answer.content_type.starts_with("text/html");
  const bool given = request.body.find(kToken) != std::string::npos;
  if (!page && !given && answer.body.find(kToken) != std::string::npos) std::abort();
  return 0;
}

// From request to answer, without a socket: what is served to whom, and what is refused.
#pragma once

#include "cli/live/command.h"

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tunnelrig::live {

/// A request as it came, nothing checked. Header fields that are missing are empty.
struct SiteRequest {
  std::string method;
  std::string target;  // path and query
  std::string host, origin, fetch_site, content_type, content_encoding, transfer_encoding, range;
  std::string body;
};

struct SiteAnswer {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  bool events = false;  // the event stream follows in place of the body
};

struct SiteSettings {
  std::string address = "127.0.0.1";  // as it listens
  int port = 0;
  bool open = false;      // reachable from elsewhere: the token is needed for everything
  std::string host_name;  // of this computer, which a browser elsewhere may call it by
  std::string token;
  std::string_view page;  // holds {{nonce}} and {{token}}
};

/// Answers requests. The rules, in the order in which they are checked (docs/live.md):
/// the Host is this server under an address, not a name that somebody's DNS made up; only GET, HEAD and POST;
/// target and body bounded; with `open`, the token in the query; no request of another site; commands by POST
/// as JSON with the token. Nothing is read from the disk, so no path leads anywhere.
class Site {
 public:
  /// Carries a command out, on any thread.
  using Execute = std::function<CommandResult(const Command&)>;

  Site(SiteSettings settings, Execute execute)
      : settings_(std::move(settings)), execute_(std::move(execute)) {}

  SiteAnswer answer(const SiteRequest& request) const;

  /// All that can be said before the body is read; status 200: read on.
  SiteAnswer answer_head(const SiteRequest& request) const;

  const SiteSettings& settings() const { return settings_; }
  std::string address() const;  // for a person to open

  static constexpr std::size_t kLongestTarget = 512;
  static constexpr std::size_t kLongestBody = 16384;

 private:
  bool host_is_ours(std::string_view host) const;
  SiteAnswer page() const;
  SiteAnswer command(const std::string& body) const;

  SiteSettings settings_;
  Execute execute_;
};

/// 32 hexadecimal digits from the kernel's random numbers.
std::string random_token();

/// True where text is an IPv4 or IPv6 address (in brackets or bare).
bool is_address(std::string_view text);
bool is_loopback(std::string_view address);

}  // namespace tunnelrig::live

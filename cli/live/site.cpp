#include "cli/live/site.h"

#include "datasets/error.h"
#include "datasets/lower_case.h"

#include <algorithm>
#include <array>

#include <arpa/inet.h>
#include <nlohmann/json.hpp>
#include <sys/random.h>

namespace tunnelrig::live {
namespace {

SiteAnswer refusal(int status, const std::string& text) {
  return {
      .status = status,
      .content_type = "application/json",
      .body = nlohmann::json{{"error", text}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

void add_safety_headers(SiteAnswer& answer) {
  answer.headers.insert(answer.headers.end(), {{"X-Content-Type-Options", "nosniff"},
                                               {"Cache-Control", "no-store"},
                                               {"Referrer-Policy", "no-referrer"},
                                               {"X-Frame-Options", "DENY"},
                                               {"Cross-Origin-Resource-Policy", "same-origin"},
                                               {"Cross-Origin-Opener-Policy", "same-origin"}});
  const bool has_policy = std::any_of(answer.headers.begin(), answer.headers.end(), [](const auto& header) {
    return header.first == "Content-Security-Policy";
  });
  if (!has_policy)
    answer.headers.emplace_back("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
}

/// Takes as long for a wrong beginning as for a wrong end.
bool same_secret(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

std::string_view query_token(std::string_view target) {
  const auto question = target.find('?');
  std::string_view query = question == std::string_view::npos ? "" : target.substr(question + 1);
  while (!query.empty()) {
    const std::string_view field = query.substr(0, query.find('&'));
    if (field.starts_with("token=")) return field.substr(6);
    query.remove_prefix(std::min(query.size(), field.size() + 1));
  }
  return "";
}

/// "host:port" or "[::1]:port" cut at the port.
std::pair<std::string_view, std::string_view> cut_port(std::string_view host) {
  const auto bracket = host.rfind(']');
  const auto colon = host.rfind(':');
  if (colon == std::string_view::npos || (bracket != std::string_view::npos && colon < bracket))
    return {host, ""};
  return {host.substr(0, colon), host.substr(colon + 1)};
}

void replace_all(std::string& text, std::string_view what, std::string_view with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

}  // namespace

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError("the kernel gives no random numbers, so there is no token");
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

bool is_address(std::string_view text) {
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  const std::string copy(text);
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return ::inet_pton(AF_INET, copy.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, copy.c_str(), bytes.data()) == 1;
}

bool is_loopback(std::string_view address) {
  return address == "localhost" || address == "::1" || address == "[::1]" ||
         (address.starts_with("127.") && is_address(address));
}

/// A page of another site can make its own name lead to our address (DNS rebinding), but not an address.
bool Site::host_is_ours(std::string_view host) const {
  const auto [name, port] = cut_port(host);
  if (port != std::to_string(settings_.port) && !(port.empty() && settings_.port == 80)) return false;
  const std::string lowered = lower_case(name);
  if (is_loopback(lowered)) return true;
  if (!settings_.open) return false;
  const std::string own = lower_case(settings_.host_name);
  return is_address(lowered) || (!own.empty() && (lowered == own || lowered == own + ".local"));
}

std::string Site::address() const {
  const bool v6 = settings_.address.find(':') != std::string::npos;
  std::string host =
      v6 && !settings_.address.starts_with('[') ? "[" + settings_.address + "]" : settings_.address;
  if ((host == "0.0.0.0" || host == "[::]") && !settings_.host_name.empty()) host = settings_.host_name;
  std::string text = fmt::format("http://{}:{}/", host, settings_.port);
  if (settings_.open) text += "?token=" + settings_.token;
  return text;
}

SiteAnswer Site::answer_head(const SiteRequest& request) const {
  if (!host_is_ours(request.host))
    return refusal(403, fmt::format("this server is not called so; open {}",
                                    fmt::format("http://127.0.0.1:{}/", settings_.port)));
  if (request.method != "GET" && request.method != "HEAD" && request.method != "POST") {
    SiteAnswer answer = refusal(405, "GET, HEAD and POST are all there is");
    answer.headers.emplace_back("Allow", "GET, HEAD, POST");
    return answer;
  }
  if (request.target.size() > kLongestTarget) return refusal(414, "the address is too long");
  if (!request.range.empty()) return refusal(416, "nothing here comes in parts");
  if (settings_.open && !same_secret(query_token(request.target), settings_.token))
    return refusal(403, "the token is missing or wrong; open the address that the program printed");
  const std::string_view path = std::string_view(request.target).substr(0, request.target.find('?'));
  const bool posted = request.method == "POST";
  if (path == "/command") {
    if (!posted) {
      SiteAnswer answer = refusal(405, "commands are posted");
      answer.headers.emplace_back("Allow", "POST");
      return answer;
    }
  } else if (path == "/" || path == "/events") {
    if (posted) {
      SiteAnswer answer = refusal(405, "nothing can be posted here");
      answer.headers.emplace_back("Allow", "GET, HEAD");
      return answer;
    }
  } else {
    return refusal(404, "there is nothing here");
  }
  if (path == "/") return {};
  if (!request.origin.empty() && lower_case(request.origin) != lower_case("http://" + request.host))
    return refusal(403, "this comes from another site");
  if (!request.fetch_site.empty() && request.fetch_site != "same-origin" && request.fetch_site != "none")
    return refusal(403, "this comes from another site");
  if (!posted) return {};
  if (!request.transfer_encoding.empty()) return refusal(411, "the length of a command must be known");
  const std::string type = lower_case(request.content_type.substr(0, request.content_type.find(';')));
  if (type != "application/json" || !request.content_encoding.empty())
    return refusal(415, "a command is application/json, not compressed");
  return {};
}

SiteAnswer Site::answer(const SiteRequest& request) const {
  SiteAnswer answer = answer_head(request);
  if (answer.status == 200) {
    const std::string_view path = std::string_view(request.target).substr(0, request.target.find('?'));
    if (path == "/command") {
      answer = command(request.body);
    } else if (path == "/events") {
      answer.content_type = "text/event-stream";
      answer.events = request.method == "GET";
    } else {
      answer = page();
    }
  }
  add_safety_headers(answer);
  return answer;
}

SiteAnswer Site::page() const {
  SiteAnswer answer{.content_type = "text/html; charset=utf-8", .body = std::string(settings_.page)};
  const std::string nonce = random_token();
  replace_all(answer.body, "{{nonce}}", nonce);
  replace_all(answer.body, "{{token}}", settings_.token);
  answer.headers.emplace_back(
      "Content-Security-Policy",
      fmt::format("default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; img-src data: blob:; "
                  "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                  nonce));
  return answer;
}

SiteAnswer Site::command(const std::string& body) const {
  if (body.size() > kLongestBody) return refusal(413, "a command is shorter than that");
  try {
    const Command command = parse_command(body);
    if (!same_secret(command.token, settings_.token))
      return refusal(403, "the token is wrong: the program was started anew; reload the page");
    const CommandResult result = execute_(command);
    if (!result.problem.empty()) return refusal(409, result.problem);
    nlohmann::ordered_json json{{"ok", true}};
    if (!result.text.empty()) json["text"] = result.text;
    return {.content_type = "application/json",
            .body = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
  } catch (const InputError& error) {
    return refusal(400, error.what());
  } catch (const StorageError& error) {
    return refusal(500, error.what());
  }
}

}  // namespace tunnelrig::live

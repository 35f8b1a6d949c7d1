// Every refusal of the live page's server, without a socket.
#include "cli/live/site.h"

#include "support/message_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::live {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

struct TestedSite : testing::Test {
  std::vector<Command> carried_out;

  Site site(bool open = false) {
    return Site({.address = open ? "0.0.0.0" : "127.0.0.1",
                 .port = 8266,
                 .open = open,
                 .host_name = "rig-pc",
                 .token = kToken,
                 .page = "<meta content=\"{{token}}\"><script nonce=\"{{nonce}}\"></script>"},
                [this](const Command& command) {
                  carried_out.push_back(command);
                  if (command.name == "next") return CommandResult{"there is no plan", ""};
                  return CommandResult{"", "done"};
                });
  }

  static SiteRequest get(const std::string& target) {
    return {.method = "GET", .target = target, .host = "127.0.0.1:8266"};
  }
  static SiteRequest post(const std::string& body) {
    return {.method = "POST",
            .target = "/command",
            .host = "127.0.0.1:8266",
            .origin = "http://127.0.0.1:8266",
            .fetch_site = "same-origin",
            .content_type = "application/json",
            .body = body};
  }
  static std::string command(const std::string& rest) {
    return std::string(R"({"token":")") + kToken + "\"," + rest + "}";
  }
};

std::string header(const SiteAnswer& answer, const std::string& name) {
  for (const auto& [key, value] : answer.headers)
    if (key == name) return value;
  return "";
}

TEST_F(TestedSite, ServesThePageWithANewNonceEachTime) {
  const SiteAnswer first = site().answer(get("/")), second = site().answer(get("/"));
  EXPECT_EQ(first.status, 200);
  EXPECT_THAT(first.body, HasSubstr(kToken));
  EXPECT_THAT(first.body, Not(HasSubstr("{{")));
  EXPECT_NE(first.body, second.body);
  const auto at = first.body.find("nonce=\"") + 7;
  EXPECT_THAT(header(first, "Content-Security-Policy"),
              HasSubstr("'nonce-" + first.body.substr(at, 32) + "'"));
  EXPECT_THAT(header(first, "Content-Security-Policy"), HasSubstr("default-src 'none'"));
  EXPECT_EQ(site().answer(get("/events")).content_type, "text/event-stream");
  EXPECT_TRUE(site().answer(get("/events")).events);
}

TEST_F(TestedSite, EveryAnswerIsGuarded) {
  for (const SiteRequest& request : {get("/"), get("/nothing"), post("{}"), SiteRequest{}}) {
    const SiteAnswer answer = site().answer(request);
    EXPECT_EQ(header(answer, "X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(header(answer, "Cache-Control"), "no-store");
    EXPECT_THAT(header(answer, "Content-Security-Policy"), HasSubstr("frame-ancestors 'none'"));
    EXPECT_EQ(header(answer, "Access-Control-Allow-Origin"), "");
  }
}

TEST_F(TestedSite, AnswersToNoNameThatSomebodysDnsMadeUp) {
  for (const char* host :
       {"", "evil.example:8266", "127.0.0.1.evil.example:8266", "127.0.0.1:80", "127.0.0.1", "localhost",
        "rig-pc:8266", "192.168.1.5:8266", "127.evil:8266", "[::1]:1"}) {
    SiteRequest request = get("/");
    request.host = host;
    const SiteAnswer answer = site().answer(request);
    EXPECT_EQ(answer.status, 403) << host;
    EXPECT_THAT(answer.body, Not(HasSubstr(kToken)));
  }
  for (const char* host :
       {"127.0.0.1:8266", "localhost:8266", "LOCALHOST:8266", "[::1]:8266", "127.0.0.2:8266"}) {
    SiteRequest request = get("/");
    request.host = host;
    EXPECT_EQ(site().answer(request).status, 200) << host;
  }
}

TEST_F(TestedSite, OpenToOthersItNeedsTheTokenForEverything) {
  const Site open = site(true);
  for (const char* host : {"rig-pc:8266", "RIG-PC.local:8266", "192.168.1.5:8266", "[fe80::1]:8266"}) {
    SiteRequest request = get(std::string("/?token=") + kToken);
    request.host = host;
    EXPECT_EQ(open.answer(request).status, 200) << host;
  }
  for (const char* target : {"/", "/events", "/?token=", "/?token=0123456789abcdef0123456789abcdee",
                             "/nothing", "/?x=1&token", "/events?token=0123456789abcdef0123456789abcdef0"}) {
    const SiteAnswer answer = open.answer(get(target));
    EXPECT_EQ(answer.status, 403) << target;
    EXPECT_THAT(answer.body, Not(HasSubstr(kToken)));
  }
  SiteRequest request = post(command(R"("command":"stop")"));
  EXPECT_EQ(open.answer(request).status, 403) << "in the body alone";
  request.target += std::string("?x=1&token=") + kToken;
  EXPECT_EQ(open.answer(request).status, 200);
  request.host = "evil.example:8266";
  EXPECT_EQ(open.answer(request).status, 403);
}

TEST_F(TestedSite, RefusesOtherMethodsPathsAndSizes) {
  for (const char* method : {"PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get", ""}) {
    SiteRequest request = get("/");
    request.method = method;
    EXPECT_EQ(site().answer(request).status, 405) << method;
  }
  for (const char* path : {"/../../etc/passwd", "/..", "//", "/%2e%2e/etc/passwd", "/index.html", "/events/",
                           "", "http://127.0.0.1:8266/", "/command/../events", "/data/../../x"})
    EXPECT_EQ(site().answer(get(path)).status, 404) << path;
  EXPECT_EQ(site().answer(get("/command")).status, 405);
  EXPECT_EQ(site().answer(get("/?" + std::string(600, 'x'))).status, 414);
  SiteRequest ranged = get("/");
  ranged.range = "bytes=0-1,2-3";
  EXPECT_EQ(site().answer(ranged).status, 416);
  SiteRequest posted = post("{}");
  posted.target = "/events";
  EXPECT_EQ(site().answer(posted).status, 405);
  EXPECT_EQ(site().answer(post(std::string(20000, ' '))).status, 413);
  EXPECT_TRUE(carried_out.empty());
}

TEST_F(TestedSite, RefusesWhatComesFromAnotherSite) {
  const std::string stop = command(R"("command":"stop")");
  const auto status = [&](auto change) {
    SiteRequest request = post(stop);
    change(request);
    return site().answer(request).status;
  };
  EXPECT_EQ(status([](SiteRequest& r) { r.origin = "http://evil.example"; }), 403);
  EXPECT_EQ(status([](SiteRequest& r) { r.origin = "null"; }), 403);
  EXPECT_EQ(status([](SiteRequest& r) { r.origin = "https://127.0.0.1:8266"; }), 403);
  EXPECT_EQ(status([](SiteRequest& r) { r.origin = "http://127.0.0.1:8267"; }), 403);
  EXPECT_EQ(status([](SiteRequest& r) { r.fetch_site = "cross-site"; }), 403);
  EXPECT_EQ(status([](SiteRequest& r) { r.fetch_site = "same-site"; }), 403);
  EXPECT_EQ(status([](SiteRequest& r) { r.content_type = "text/plain"; }), 415);
  EXPECT_EQ(status([](SiteRequest& r) { r.content_type = "application/x-www-form-urlencoded"; }), 415);
  EXPECT_EQ(status([](SiteRequest& r) { r.content_type = ""; }), 415);
  EXPECT_EQ(status([](SiteRequest& r) { r.content_encoding = "gzip"; }), 415);
  EXPECT_EQ(status([](SiteRequest& r) { r.transfer_encoding = "chunked"; }), 411);
  SiteRequest events = get("/events");
  events.origin = "http://evil.example";
  EXPECT_EQ(site().answer(events).status, 403);
  EXPECT_TRUE(carried_out.empty());
  EXPECT_EQ(status([](SiteRequest& r) { r.content_type = "Application/JSON; charset=utf-8"; }), 200);
  EXPECT_EQ(status([](SiteRequest& r) { r.origin = r.fetch_site = ""; }), 200) << "a client of one's own";
}

TEST_F(TestedSite, CommandsNeedTheToken) {
  for (const char* body : {R"({"command":"stop"})", R"({"command":"stop","token":""})",
                           R"({"command":"stop","token":"0123456789abcdef0123456789abcdee"})",
                           R"({"command":"stop","token":"0123456789abcdef0123456789abcdef0"})"})
    EXPECT_EQ(site().answer(post(body)).status, 403) << body;
  EXPECT_TRUE(carried_out.empty());
  const SiteAnswer answer =
      site().answer(post(command(R"("command":"note","run":"R0001","text":"draught")")));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(nlohmann::json::parse(answer.body), (nlohmann::json{{"ok", true}, {"text", "done"}}));
  ASSERT_EQ(carried_out.size(), 1u);
  EXPECT_EQ(carried_out[0].text, "draught");
}

TEST_F(TestedSite, RefusedCommandsSayWhy) {
  const SiteAnswer answer = site().answer(post(command(R"("command":"next")")));
  EXPECT_EQ(answer.status, 409);
  EXPECT_EQ(nlohmann::json::parse(answer.body)["error"], "there is no plan");
}

struct BadCommand {
  const char* body;
  const char* says;
};

class BadCommands : public testing::TestWithParam<BadCommand> {};

TEST_P(BadCommands, AreInputErrors) {
  EXPECT_THAT(test::message_of([&] { parse_command(GetParam().body); }), HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadCommands,
    testing::Values(
        BadCommand{"", "a JSON object"}, BadCommand{"[]", "a JSON object"},
        BadCommand{"{\"a\":", "a JSON object"}, BadCommand{"{}", "no such command"},
        BadCommand{R"({"command":"format"})", "no such command"},
        BadCommand{R"({"command":3})", "a text is expected"},
        BadCommand{R"({"command":"next","run":"R1"})", "next has no such key"},
        BadCommand{R"({"command":"start","location":7})", "location: a text"},
        BadCommand{R"({"command":"start","location":"a\nb"})", "no control characters"},
        BadCommand{R"({"command":"start","location":" OT"})", "no blanks"},
        BadCommand{R"({"command":"start","kind":"tara"})", "thrust or tare"},
        BadCommand{R"({"command":"start","duration_s":0})", "outside 0.1 to 100000"},
        BadCommand{R"({"command":"start","duration_s":1e300})", "outside"},
        BadCommand{R"({"command":"start","repeat":-1})", "outside 0"},
        BadCommand{R"({"command":"metadata"})", "an object of numbers"},
        BadCommand{R"({"command":"metadata","values":{"colour":1}})", "no quantity"},
        BadCommand{R"({"command":"metadata","values":{"relative_humidity":40}})", "outside 0 to 1"},
        BadCommand{R"({"command":"metadata","values":{"speed_rpm":"fast"}})", "a number is expected"},
        BadCommand{R"({"command":"target","c_t_u95":0})", "outside"}));

TEST(Commands, AreRead) {
  const Command start = parse_command(
      R"({"command":"start","location":"H4V-2","session":"S2","repeat":3,"kind":"tare","duration_s":20})");
  EXPECT_EQ(start.location, "H4V-2");
  EXPECT_EQ(start.repeat, 3);
  EXPECT_EQ(start.kind, RunKind::kTare);
  EXPECT_EQ(start.duration_s, 20);
  EXPECT_EQ(parse_command(R"({"command":"stop","run":"R0007"})").run, "R0007");
  const Command metadata =
      parse_command(R"({"command":"metadata","values":{"speed_rpm":4998.5,"air_temperature_C":null}})");
  EXPECT_EQ(metadata.values.at("speed_rpm"), 4998.5);
  EXPECT_EQ(metadata.values.at("air_temperature_C"), std::nullopt);
}

TEST(Addresses, AreToldFromNames) {
  for (const char* text : {"127.0.0.1", "::1", "[::1]", "10.0.0.1", "fe80::1"})
    EXPECT_TRUE(is_address(text)) << text;
  for (const char* text : {"", "localhost", "1.2.3", "1.2.3.4.example", "[::1", "0x7f.1"})
    EXPECT_FALSE(is_address(text)) << text;
  EXPECT_TRUE(is_loopback("127.0.0.1"));
  EXPECT_FALSE(is_loopback("127.0.0.1.example"));
  EXPECT_FALSE(is_loopback("0.0.0.0"));
}

}  // namespace
}  // namespace tunnelrig::live

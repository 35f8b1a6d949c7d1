// A viewer over a real socket.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

namespace tunnelrig::test {

struct HttpReply {
  int status = 0;
  std::string head, body;
};

/// Sends `request` as it stands and reads until the server closes. Status 0 where nothing came.
HttpReply ask(int port, const std::string& request);

/// GET or POST with the headers that a browser on the same computer sends.
HttpReply get(int port, const std::string& target);
HttpReply post(int port, const std::string& json);

/// An open event stream.
class EventStream {
 public:
  explicit EventStream(int port, const std::string& target = "/events");
  ~EventStream();
  EventStream(const EventStream&) = delete;
  EventStream& operator=(const EventStream&) = delete;

  /// The data of the next event `name` that `wanted` agrees to; nothing where none came within `patience`.
  std::optional<std::string> next(const std::string& name,
                                  const std::function<bool(const std::string&)>& wanted = {},
                                  std::chrono::milliseconds patience = std::chrono::seconds(90));

 private:
  int socket_;
  std::string received_;
};

}  // namespace tunnelrig::test

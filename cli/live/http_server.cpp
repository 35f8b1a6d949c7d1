#include "cli/live/http_server.h"

#include "datasets/error.h"

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>

#include <httplib.h>

namespace tunnelrig::live {
namespace {

constexpr std::size_t kThreads = Viewers::kMost + 6;  // one for each viewer, and some for the rest
constexpr std::chrono::seconds kReadTimeout{5};
constexpr std::chrono::seconds kWriteTimeout{5};
constexpr std::chrono::milliseconds kPatience{500};
constexpr std::chrono::seconds kHeartbeat{10};

SiteRequest request_of(const httplib::Request& request) {
  return {.method = request.method,
          .target = request.target,
          .host = request.get_header_value("Host"),
          .origin = request.get_header_value("Origin"),
          .fetch_site = request.get_header_value("Sec-Fetch-Site"),
          .content_type = request.get_header_value("Content-Type"),
          .content_encoding = request.get_header_value("Content-Encoding"),
          .transfer_encoding = request.get_header_value("Transfer-Encoding"),
          .range = request.get_header_value("Range"),
          .body = request.body};
}

/// Writes a viewer's events until it leaves or the server ends.
bool stream(const std::shared_ptr<Viewer>& viewer, httplib::DataSink& sink) {
  auto spoken = std::chrono::steady_clock::now();
  while (!viewer->closed()) {
    const EventText text = viewer->next(kPatience);
    const auto now = std::chrono::steady_clock::now();
    if (text) {
      if (!sink.write(text->data(), text->size())) return false;
      spoken = now;
    } else if (now - spoken > kHeartbeat) {
      constexpr std::string_view kComment = ": still here\n\n";
      if (!sink.write(kComment.data(), kComment.size())) return false;
      spoken = now;
    } else if (!sink.is_writable()) {
      return false;
    }
  }
  sink.done();
  return true;
}

void write_answer(const SiteAnswer& answer, Viewers& viewers, httplib::Response& response) {
  response.status = answer.status;
  for (const auto& [name, value] : answer.headers) response.set_header(name, value);
  if (!answer.events) {
    response.set_content(answer.body, answer.content_type);
    return;
  }
  const std::shared_ptr<Viewer> viewer = viewers.join();
  if (!viewer) {
    response.status = 503;
    response.set_content(R"({"error": "as many pages as there may be are open; close one"})",
                         "application/json");
    return;
  }
  response.set_chunked_content_provider(
      answer.content_type, [viewer](std::size_t, httplib::DataSink& sink) { return stream(viewer, sink); });
}

[[noreturn]] void refuse_to_listen(const std::string& address, int port, int error) {
  if (error == EADDRINUSE) {
    throw InputError(
        fmt::format("port {} of {} is taken, perhaps by another tunnelrig; --live {} or --port {} takes "
                    "another, 0 any free one",
                    port, address, port + 1, port + 1));
  }
  if (error == EACCES)
    throw InputError(fmt::format("port {} needs privileges; ports from 1024 on do not", port));
  throw InputError(fmt::format("cannot listen on {}: it is no address of this computer ({})", address,
                               std::generic_category().message(error)));
}

}  // namespace

class HttpServer::Implementation {
 public:
  Implementation(const std::string& address, int port) {
    server_.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    // Without SO_REUSEPORT, which would let two servers share a port.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server_.set_keep_alive_max_count(1);  // what follows a refused request is never taken for another one
    server_.set_read_timeout(kReadTimeout);
    server_.set_write_timeout(kWriteTimeout);
    server_.set_tcp_nodelay(true);
    server_.set_payload_max_length(Site::kLongestBody);
    errno = 0;
    if (port == 0) {
      port_ = server_.bind_to_any_port(address);
      if (port_ <= 0) refuse_to_listen(address, port, errno != 0 ? errno : EADDRNOTAVAIL);
    } else {
      if (!server_.bind_to_port(address, port))
        refuse_to_listen(address, port, errno != 0 ? errno : EADDRNOTAVAIL);
      port_ = port;
    }
  }

  ~Implementation() {
    if (viewers_ != nullptr) viewers_->close();
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  int port() const { return port_; }

  void serve(const Site& site, Viewers& viewers) {
    viewers_ = &viewers;
    server_.set_pre_routing_handler(
        [&site, &viewers](const httplib::Request& request, httplib::Response& response) {
          const SiteRequest asked = request_of(request);
          const bool post = request.method == "POST";
          const SiteAnswer answer = post ? site.answer_head(asked) : site.answer(asked);
          if (post && answer.status == 200)
            return httplib::Server::HandlerResponse::Unhandled;  // the body is read
          write_answer(post ? site.answer(asked) : answer, viewers, response);
          return httplib::Server::HandlerResponse::Handled;
        });
    server_.Post("/command", [&site, &viewers](const httplib::Request& request, httplib::Response& response) {
      write_answer(site.answer(request_of(request)), viewers, response);
    });
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    // stop() has an effect only on a server that runs
    while (!server_.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

 private:
  httplib::Server server_;
  int port_ = 0;
  Viewers* viewers_ = nullptr;
  std::thread thread_;
};

HttpServer::HttpServer(const std::string& address, int port)
    : implementation_(std::make_unique<Implementation>(address, port)) {}
HttpServer::~HttpServer() = default;
int HttpServer::port() const { return implementation_->port(); }
void HttpServer::serve(const Site& site, Viewers& viewers) { implementation_->serve(site, viewers); }

}  // namespace tunnelrig::live

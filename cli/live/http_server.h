// The sockets of the live page.
#pragma once

#include "cli/live/site.h"
#include "cli/live/viewers.h"

#include <memory>
#include <string>

namespace tunnelrig::live {

/// Serves a site and its event stream on threads of its own until it is destroyed.
class HttpServer {
 public:
  /// Listens at once, so that whoever constructs it knows whether the port could be had; port 0 takes any
  /// free one. Throws InputError, with a way on, where the port is taken or the address is not this
  /// computer's.
  HttpServer(const std::string& address, int port);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const;

  /// Begins to answer. Site and viewers must outlive the server; `viewers` are closed with it.
  void serve(const Site& site, Viewers& viewers);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace tunnelrig::live

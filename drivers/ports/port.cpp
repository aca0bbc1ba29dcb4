#include "drivers/ports/port.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/ports/serial_port.h"
#include "drivers/ports/tcp_port.h"
#include "drivers/ports/udp_port.h"

namespace airworthy::drivers {
namespace {

// A flooding device must not keep the other handlers of the process waiting.
constexpr int kReadsPerWakeUp = 16;

bool would_block(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

std::unique_ptr<Port> Port::make(boost::asio::io_context& io, const LinkAddress& address,
                                 const Params& params) {
  switch (address.kind) {
    case LinkKind::kSerial:
      return std::make_unique<SerialPort>(io, address, params);
    case LinkKind::kUdpListen:
    case LinkKind::kUdp:
      return std::make_unique<UdpPort>(io, address, params);
    case LinkKind::kTcp:
      return std::make_unique<TcpPort>(io, address, params);
  }
  return nullptr;
}

Port::Port(boost::asio::io_context& io, LinkAddress address, const Params& params)
    : address_{std::move(address)},
      params_{params},
      retry_{io},
      pause_{params.first_pause},
      descriptor_{io} {}

Port::~Port() = default;

void Port::start(Events events) {
  events_ = std::move(events);
  open();
}

void Port::open() {
  const auto opened = open_descriptor();
  if (!opened) {
    close(opened.error().text);
    return;
  }
  descriptor_.assign(*opened);
  session_ = std::make_shared<int>(*opened);
  if (!connects()) {
    become_open();
    return;
  }
  retry_.expires_after(params_.longest_pause);
  retry_.async_wait([this, session = std::weak_ptr{session_}](const boost::system::error_code& error) {
    if (!error && !session.expired() && !is_open_) close("no answer");
  });
  descriptor_.async_wait(boost::asio::posix::stream_descriptor::wait_write,
                         [this, session = std::weak_ptr{session_}](const boost::system::error_code& error) {
                           const auto alive = session.lock();
                           if (!alive) return;
                           int cause = error.value();
                           socklen_t size = sizeof cause;
                           if (!error) getsockopt(*alive, SOL_SOCKET, SO_ERROR, &cause, &size);
                           if (cause != 0) {
                             close(std::strerror(cause));
                           } else {
                             become_open();
                           }
                         });
}

void Port::become_open() {
  is_open_ = true;
  retry_.cancel();
  detail_.clear();
  pause_ = params_.first_pause;
  ++counters_.opens;
  const std::weak_ptr session = session_;
  if (events_.on_open) events_.on_open();
  if (!session.expired()) wait_to_read();
}

void Port::close(const std::string& why) {
  const bool was_open = is_open_;
  const bool is_news = was_open || why != detail_;
  if (was_open) {
    ++counters_.losses;
  } else {
    ++counters_.open_failures;
  }
  is_open_ = false;
  detail_ = why;
  session_.reset();
  boost::system::error_code ignored;
  descriptor_.close(ignored);
  counters_.writes_dropped += static_cast<std::int64_t>(queue_.size());
  queue_.clear();
  begun_ = 0;
  waits_to_write_ = false;

  retry_.expires_after(pause_);
  pause_ = std::min(pause_ * 2, params_.longest_pause);
  retry_.async_wait([this](const boost::system::error_code& error) {
    if (!error) open();
  });
  if (is_news && events_.on_close) events_.on_close(why);
}

void Port::reopen(const std::string& why) {
  if (is_open_) close(why);
}

void Port::wait_to_read() {
  descriptor_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                         [this, session = std::weak_ptr{session_}](const boost::system::error_code& error) {
                           if (session.expired()) return;
                           if (error) {
                             close(error.message());
                           } else {
                             read_available();
                           }
                         });
}

void Port::read_available() {
  const auto session = session_;
  for (int reads = 0; reads < kReadsPerWakeUp; ++reads) {
    const ssize_t count = receive(*session, buffer_);
    if (count < 0 && would_block(errno)) break;
    if (count < 0 && is_datagram() && errno == ECONNREFUSED) {
      ++counters_.refusals;
      continue;
    }
    if (count < 0) {
      close(std::strerror(errno));
      return;
    }
    if (count == 0 && !is_datagram()) {
      close("closed by the other side");
      return;
    }
    counters_.bytes_received += count;
    if (events_.on_data) events_.on_data(std::span{buffer_}.first(static_cast<std::size_t>(count)));
    if (session_ != session) return;  // the user closed it
  }
  wait_to_read();
}

void Port::write(std::span<const std::uint8_t> message) {
  if (!is_open_ || message.empty()) {
    ++counters_.writes_dropped;
    return;
  }
  if (queue_.size() >= params_.longest_queue) {
    // A message whose first bytes are out must be finished.
    const std::ptrdiff_t oldest = begun_ > 0 && queue_.size() > 1 ? 1 : 0;
    queue_.erase(queue_.begin() + oldest);
    if (oldest == 0) begun_ = 0;
    ++counters_.writes_dropped;
  }
  queue_.emplace_back(message.begin(), message.end());
  if (!waits_to_write_) write_queued();
}

void Port::write_queued() {
  while (!queue_.empty()) {
    const auto rest = std::span{queue_.front()}.subspan(begun_);
    const ssize_t count = send(*session_, rest);
    if (count < 0 && would_block(errno)) {
      waits_to_write_ = true;
      descriptor_.async_wait(
          boost::asio::posix::stream_descriptor::wait_write,
          [this, session = std::weak_ptr{session_}](const boost::system::error_code& error) {
            if (session.expired()) return;
            waits_to_write_ = false;
            if (error) {
              close(error.message());
            } else {
              write_queued();
            }
          });
      return;
    }
    if (count < 0 && is_datagram()) {
      // Nobody there, or no way to there: this message is lost, the next may not be.
      ++counters_.writes_dropped;
      queue_.pop_front();
      continue;
    }
    if (count < 0) {
      // The reader sees the same break and reports it; closing here would pull the link from under the
      // caller.
      counters_.writes_dropped += static_cast<std::int64_t>(queue_.size());
      queue_.clear();
      begun_ = 0;
      return;
    }
    counters_.bytes_sent += count;
    begun_ += static_cast<std::size_t>(count);
    if (begun_ < queue_.front().size()) continue;
    queue_.pop_front();
    begun_ = 0;
  }
}

ssize_t Port::receive(int descriptor, std::span<std::uint8_t> buffer) {
  return ::read(descriptor, buffer.data(), buffer.size());
}

ssize_t Port::send(int descriptor, std::span<const std::uint8_t> bytes) {
  return ::write(descriptor, bytes.data(), bytes.size());
}

}  // namespace airworthy::drivers

#pragma once

#include <sys/types.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/ports/link_address.h"
#include "runtime/error.h"

namespace airworthy::drivers {

/// Monotonic counts since construction.
struct PortCounters {
  std::int64_t bytes_received = 0;
  std::int64_t bytes_sent = 0;
  std::int64_t opens = 0;  ///< successful ones
  std::int64_t open_failures = 0;
  std::int64_t losses = 0;          ///< an open link broke
  std::int64_t writes_dropped = 0;  ///< pushed out of a full queue, or nowhere to send to
  std::int64_t refusals = 0;        ///< the remote UDP port was closed; the link stays open
};

/// A link to a device: owns the descriptor, reopens it by itself with growing pauses, never blocks. Bytes in
/// both directions; what they mean is the codec's business.
///
/// Pauses run in real time also where vehicle time runs faster: they spare the computer, not the flight.
class Port {
 public:
  struct Events {
    std::function<void(std::span<const std::uint8_t>)> on_data;  ///< valid during the call only
    std::function<void()> on_open;
    std::function<void(const std::string& why)>
        on_close;  ///< also once for each failure to open with a new cause
  };
  struct Params {
    std::chrono::milliseconds first_pause{100};
    std::chrono::milliseconds longest_pause{
        5000};                       ///< the pause doubles up to this; also the limit for connecting
    std::size_t longest_queue = 64;  ///< writes; beyond it the oldest one not begun is dropped and counted
  };

  [[nodiscard]] static std::unique_ptr<Port> make(boost::asio::io_context& io, const LinkAddress& address,
                                                  const Params& params);
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port();

  /// Opens the link, and again whenever it breaks, for the life of the port.
  void start(Events events);

  /// Queues a message, whole or not at all. Dropped and counted while the link is closed.
  void write(std::span<const std::uint8_t> message);

  /// Closes a link that its user finds dead, and opens it again after the first pause.
  void reopen(const std::string& why);

  [[nodiscard]] bool is_open() const { return is_open_; }
  /// Why it is not open; empty when it is.
  [[nodiscard]] const std::string& detail() const { return detail_; }
  [[nodiscard]] const PortCounters& counters() const { return counters_; }

 protected:
  Port(boost::asio::io_context& io, LinkAddress address, const Params& params);

  /// A non-blocking descriptor, or why there is none.
  [[nodiscard]] virtual rt::Expected<int> open_descriptor() = 0;
  /// True if the link is up only when the descriptor has become writable without an error.
  [[nodiscard]] virtual bool connects() const { return false; }
  /// As read(2) and write(2), errno included.
  [[nodiscard]] virtual ssize_t receive(int descriptor, std::span<std::uint8_t> buffer);
  [[nodiscard]] virtual ssize_t send(int descriptor, std::span<const std::uint8_t> bytes);
  /// True if an end of file or an empty read is data rather than the end of the link.
  [[nodiscard]] virtual bool is_datagram() const { return false; }

  [[nodiscard]] const LinkAddress& address() const { return address_; }

 private:
  void open();
  void become_open();
  void close(const std::string& why);
  void wait_to_read();
  void read_available();
  void write_queued();

  LinkAddress address_;
  Params params_;
  Events events_;
  boost::asio::steady_timer retry_;
  std::chrono::milliseconds pause_;
  boost::asio::posix::stream_descriptor descriptor_;
  // Handlers hold it weakly: those of a closed descriptor find it gone.
  std::shared_ptr<int> session_;
  bool is_open_ = false;
  bool waits_to_write_ = false;
  std::string detail_ = "not opened yet";
  std::deque<std::vector<std::uint8_t>> queue_;
  std::size_t begun_ = 0;  // bytes of the first message already sent
  std::array<std::uint8_t, 65536> buffer_{};
  PortCounters counters_;
};

}  // namespace airworthy::drivers

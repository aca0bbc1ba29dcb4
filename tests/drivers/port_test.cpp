#include "drivers/ports/port.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "tests/drivers/loopback_devices.h"

namespace airworthy::drivers {
namespace {

using namespace std::chrono_literals;
using testing::bound_socket;
using testing::Descriptor;
using testing::FakeDevice;
using testing::loopback;

LinkAddress address_of(const std::string& text) {
  const auto address = LinkAddress::parse(text);
  EXPECT_TRUE(address) << text;
  return address.value_or(LinkAddress{});
}

class PortTest : public ::testing::Test {
 protected:
  void start(const std::string& link, std::size_t longest_queue = 64) {
    port_ = Port::make(io_, address_of(link),
                       {.first_pause = 5ms, .longest_pause = 50ms, .longest_queue = longest_queue});
    port_->start(
        {.on_data =
             [this](std::span<const std::uint8_t> data) { received_.append(data.begin(), data.end()); },
         .on_open = [this] { ++opened_; },
         .on_close =
             [this](const std::string& why) {
               ++closed_;
               last_cause_ = why;
             }});
  }
  /// Runs the event loop until the condition holds; the deadline only ends a failing test.
  bool wait_for(const std::function<bool()>& condition) {
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (!condition() && std::chrono::steady_clock::now() < deadline) {
      io_.restart();
      io_.run_one_for(20ms);
    }
    return condition();
  }
  void write(const std::string& text) {
    port_->write(std::span{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  static void send_to(int fd, const std::string& text) {
    ASSERT_EQ(::write(fd, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  static std::string read_from(int fd) {
    char buffer[256];
    const ssize_t count = ::read(fd, buffer, sizeof buffer);
    return {buffer, count > 0 ? static_cast<std::size_t>(count) : 0};
  }

  boost::asio::io_context io_;
  std::unique_ptr<Port> port_;
  std::string received_;
  std::string last_cause_;
  int opened_ = 0;
  int closed_ = 0;
};

TEST_F(PortTest, SerialCarriesEveryByteBothWays) {
  FakeDevice device;
  start("serial:" + device.path() + ":921600");
  ASSERT_TRUE(port_->is_open());
  std::string all_bytes;
  for (int i = 0; i < 256; ++i) all_bytes.push_back(static_cast<char>(i));
  send_to(device.fd(), all_bytes);
  EXPECT_TRUE(wait_for([&] { return received_.size() >= all_bytes.size(); }));
  EXPECT_EQ(received_, all_bytes) << "raw mode: nothing is echoed, translated or taken for a signal";
  write(all_bytes);
  std::string echoed;
  while (echoed.size() < all_bytes.size()) echoed += read_from(device.fd());
  EXPECT_EQ(echoed, all_bytes);
  EXPECT_EQ(port_->counters().bytes_received, 256);
  EXPECT_EQ(port_->counters().bytes_sent, 256);
}

TEST_F(PortTest, SerialComesBackWhenTheDeviceDoes) {
  FakeDevice device;
  start("serial:" + device.path() + ":57600");
  ASSERT_EQ(opened_, 1);
  device.unplug();
  EXPECT_TRUE(wait_for([&] { return closed_ == 1; }));
  EXPECT_FALSE(port_->is_open());
  write("lost");
  EXPECT_EQ(port_->counters().writes_dropped, 1);
  EXPECT_TRUE(wait_for([&] { return port_->counters().open_failures >= 3; }));
  EXPECT_EQ(closed_, 2) << "the loss, and why it does not open; not one call per try";
  EXPECT_NE(port_->detail().find("No such file"), std::string::npos) << port_->detail();
  device.plug();
  EXPECT_TRUE(wait_for([&] { return opened_ == 2; }));
  EXPECT_EQ(port_->detail(), "");
  send_to(device.fd(), "again");
  EXPECT_TRUE(wait_for([&] { return received_ == "again"; }));
  EXPECT_EQ(port_->counters().losses, 1);
}

TEST_F(PortTest, SomethingThatIsNoSerialDeviceIsNotOpened) {
  start("serial:/dev/null:57600");
  EXPECT_FALSE(port_->is_open());
  EXPECT_EQ(closed_, 1);
  EXPECT_NE(last_cause_.find("/dev/null"), std::string::npos) << last_cause_;
}

TEST_F(PortTest, AFullQueueDropsTheOldestMessageAndNeverBlocks) {
  FakeDevice device;
  start("serial:" + device.path() + ":57600", 4);
  const std::string message(1000, 'm');
  for (int i = 0; i < 1000; ++i) write(message);
  EXPECT_GT(port_->counters().writes_dropped, 0);
  // What does arrive is whole messages: the one whose beginning was sent was finished.
  fcntl(device.fd(), F_SETFL, O_NONBLOCK);
  const auto dropped = static_cast<std::size_t>(port_->counters().writes_dropped);
  std::size_t arrived = 0;
  EXPECT_TRUE(wait_for([&] {
    arrived += read_from(device.fd()).size();
    return arrived == (1000 - dropped) * message.size();
  })) << arrived
      << " bytes, " << dropped << " dropped";
}

TEST_F(PortTest, UdpListenAnswersWhoeverSentLast) {
  std::uint16_t port = 0;
  bound_socket(SOCK_DGRAM, port).close();
  start("udp-listen:127.0.0.1:" + std::to_string(port));
  ASSERT_TRUE(port_->is_open());
  write("to nobody");
  EXPECT_EQ(port_->counters().writes_dropped, 1);
  for (const char* const text : {"first", "second"}) {
    std::uint16_t own_port = 0;
    const Descriptor device = bound_socket(SOCK_DGRAM, own_port);
    const sockaddr_in there = loopback(port);
    ASSERT_EQ(connect(device.get(), reinterpret_cast<const sockaddr*>(&there), sizeof there), 0);
    received_.clear();
    send_to(device.get(), text);
    EXPECT_TRUE(wait_for([&] { return received_ == text; }));
    write(std::string{"answer to "} + text);
    EXPECT_EQ(read_from(device.get()), std::string{"answer to "} + text);
  }
}

TEST_F(PortTest, UdpSurvivesARemotePortThatIsClosed) {
  std::uint16_t port = 0;
  bound_socket(SOCK_DGRAM, port).close();
  start("udp:127.0.0.1:" + std::to_string(port));
  write("anybody?");
  EXPECT_TRUE(wait_for([&] { return port_->counters().refusals == 1; }));
  EXPECT_TRUE(port_->is_open());
  const Descriptor device = bound_socket(SOCK_DGRAM, port);
  write("now?");
  EXPECT_EQ(read_from(device.get()), "now?");
}

TEST_F(PortTest, TcpReconnectsToAServerThatRestarts) {
  std::uint16_t port = 0;
  bound_socket(SOCK_STREAM, port).close();
  start("tcp:127.0.0.1:" + std::to_string(port));
  EXPECT_TRUE(wait_for([&] { return port_->counters().open_failures >= 2; }));
  EXPECT_EQ(closed_, 1);
  for (int round = 1; round <= 2; ++round) {
    const Descriptor server = bound_socket(SOCK_STREAM, port);
    EXPECT_TRUE(wait_for([&] { return opened_ == round; }));
    const Descriptor connection{accept(server.get(), nullptr, nullptr)};
    send_to(connection.get(), "hello");
    received_.clear();
    EXPECT_TRUE(wait_for([&] { return received_ == "hello"; }));
    write("hi");
    EXPECT_EQ(read_from(connection.get()), "hi");
  }
  EXPECT_TRUE(wait_for([&] { return port_->counters().losses == 2; }));
}

TEST_F(PortTest, ReopenClosesAndOpensAgain) {
  FakeDevice device;
  start("serial:" + device.path() + ":57600");
  port_->reopen("silent");
  EXPECT_EQ(last_cause_, "silent");
  EXPECT_TRUE(wait_for([&] { return opened_ == 2; }));
}

TEST_F(PortTest, MayBeDestroyedAtAnyTime) {
  FakeDevice device;
  start("serial:" + device.path() + ":57600");
  send_to(device.fd(), "unread");
  port_.reset();
  io_.restart();
  io_.run_for(20ms);
  EXPECT_EQ(received_, "");
}

TEST(LinkAddress, ReadsEachForm) {
  const auto serial = address_of("serial:/dev/ttyACM0:921600");
  EXPECT_EQ(serial.kind, LinkKind::kSerial);
  EXPECT_EQ(serial.target, "/dev/ttyACM0");
  EXPECT_EQ(serial.number, 921600U);
  EXPECT_EQ(address_of("udp-listen:0.0.0.0:14540").kind, LinkKind::kUdpListen);
  EXPECT_EQ(address_of("udp:10.0.0.1:14550").number, 14550U);
  EXPECT_EQ(address_of("tcp:[::1]:5760").target, "::1");
  EXPECT_EQ(address_of("serial:/dev/serial/by-id/usb-a:b:57600").target, "/dev/serial/by-id/usb-a:b");
}

TEST(LinkAddress, SaysWhatIsWrong) {
  const auto reason = [](const char* text) {
    const auto address = LinkAddress::parse(text);
    return address ? std::string{} : address.error().text;
  };
  for (const char* const text : {"", "serial", "serial:/dev/ttyS0", "can:0:1", "udp:127.0.0.1"}) {
    EXPECT_NE(reason(text).find("serial:DEVICE:BAUD"), std::string::npos) << text;
  }
  EXPECT_NE(reason("serial:/dev/ttyS0:12345").find("baud rate"), std::string::npos);
  EXPECT_NE(reason("serial:/dev/ttyS0:57600x").find("baud rate"), std::string::npos);
  EXPECT_NE(reason("serial::57600").find("missing"), std::string::npos);
  EXPECT_NE(reason("udp:localhost:14550").find("numeric"), std::string::npos);
  EXPECT_NE(reason("tcp:127.0.0.1:0").find("port"), std::string::npos);
  EXPECT_NE(reason("tcp:127.0.0.1:65536").find("port"), std::string::npos);
}

}  // namespace
}  // namespace airworthy::drivers

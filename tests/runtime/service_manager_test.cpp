#include "runtime/process/service_manager.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

namespace airworthy::rt {
namespace {

#if AIRWORTHY_HAVE_SYSTEMD

// The service manager's side of the protocol: a datagram socket named by NOTIFY_SOCKET.
class ServiceManagerTest : public ::testing::Test {
 protected:
  ServiceManagerTest() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    bound_ = bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~ServiceManagerTest() override {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    close(socket_);
    std::filesystem::remove(path_);
  }

  std::string received() const {
    std::array<char, 256> text{};
    const ssize_t size = recv(socket_, text.data(), text.size(), MSG_DONTWAIT);
    return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : std::string{};
  }

  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("service_manager_test_" + std::to_string(getpid()));
  int socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  bool bound_ = false;
  boost::asio::io_context io_;
};

TEST_F(ServiceManagerTest, IsToldOfReadinessAndOfTheEnd) {
  ASSERT_TRUE(bound_);
  ServiceManager manager{io_};
  manager.ready();
  EXPECT_EQ(received(), "READY=1");
  EXPECT_EQ(received(), "") << "nobody asked for a watchdog";
  manager.stopping();
  EXPECT_EQ(received(), "STOPPING=1");
}

TEST_F(ServiceManagerTest, TheWatchdogIsFedFromTheEventLoop) {
  ASSERT_TRUE(bound_);
  setenv("WATCHDOG_USEC", "20000", 1);
  ServiceManager manager{io_};
  manager.ready();
  EXPECT_EQ(received(), "READY=1");
  EXPECT_EQ(received(), "WATCHDOG=1");
  EXPECT_EQ(received(), "") << "the next beat comes from the loop";
  io_.run_one();
  EXPECT_EQ(received(), "WATCHDOG=1");
}

#endif

TEST(ServiceManager, WithoutOneNothingHappens) {
  unsetenv("NOTIFY_SOCKET");
  boost::asio::io_context io;
  ServiceManager manager{io};
  manager.ready();
  manager.stopping();
  EXPECT_EQ(io.poll(), 0U);
}

}  // namespace
}  // namespace airworthy::rt

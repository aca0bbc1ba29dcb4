#include "gateway/feed/endpoint.h"

#include <gtest/gtest.h>

namespace airworthy::gateway {
namespace {

TEST(Endpoint, LocalMeansThatNobodyElseCanReachIt) {
  for (const char* local :
       {"tcp://127.0.0.1:5710", "tcp://127.8.9.10:1", "tcp://localhost:5710", "tcp://[::1]:5710",
        "tcp://lo:5710", "ipc:///run/airworthy/feed", "inproc://feed"}) {
    EXPECT_TRUE(is_local_endpoint(local)) << local;
    EXPECT_EQ(endpoint_error(local), std::nullopt) << local;
  }
  for (const char* remote :
       {"tcp://*:5710", "tcp://0.0.0.0:5710", "tcp://[::]:5710", "tcp://192.168.1.2:5710", "tcp://eth0:5710",
        "tcp://127.0.0.1.example.org:5710", "tcp://localhost.example.org:5710", "tcp://[fe80::1]:5710",
        "tcp://128.0.0.1:5710"}) {
    EXPECT_FALSE(is_local_endpoint(remote)) << remote;
    EXPECT_EQ(endpoint_error(remote), std::nullopt) << remote;
  }
}

TEST(Endpoint, SaysWhatIsWrong) {
  for (const char* wrong :
       {"", "5710", "tcp://", "tcp://127.0.0.1", "tcp://127.0.0.1:", "tcp://127.0.0.1:0",
        "tcp://127.0.0.1:65536", "tcp://127.0.0.1:57x", "tcp://:5710", "udp://127.0.0.1:5710",
        "pgm://127.0.0.1:5710", "http://127.0.0.1:5710", "ipc://", "inproc://", "tcp://127.0.0.1:*"}) {
    EXPECT_NE(endpoint_error(wrong), std::nullopt) << wrong;
  }
  EXPECT_NE(endpoint_error("ipc:///" + std::string(200, 'x')), std::nullopt);
  EXPECT_EQ(endpoint_error("tcp://127.0.0.1:99999"), "\"99999\" is no port: must be 1 to 65535");
}

}  // namespace
}  // namespace airworthy::gateway

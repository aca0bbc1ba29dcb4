#include "cli/doctor/route_table.h"

#include <arpa/inet.h>

#include <bit>
#include <cstdint>
#include <sstream>
#include <tuple>

namespace airworthy::doctor {
namespace {

constexpr unsigned kRouteUp = 0x1;        // RTF_UP of <linux/route.h>
constexpr unsigned kRouteReject = 0x200;  // RTF_REJECT

}  // namespace

std::optional<Route> find_route(std::string_view table, const std::string& address) {
  in_addr target{};
  if (inet_pton(AF_INET, address.c_str(), &target) != 1) return std::nullopt;

  std::optional<Route> best;
  std::tuple<int, std::int64_t> best_rank;  // prefix length, -metric
  std::istringstream lines{std::string{table}};
  std::string line;
  std::getline(lines, line);  // the heading
  while (std::getline(lines, line)) {
    std::istringstream fields{line};
    Route route;
    std::uint32_t destination = 0;  // as the kernel holds it: network byte order
    std::uint32_t mask = 0;
    std::string gateway;
    unsigned flags = 0;
    std::string use_counts;
    std::int64_t metric = 0;
    fields >> route.interface >> std::hex >> destination >> gateway >> flags >> std::dec >> use_counts >>
        use_counts >> metric >> std::hex >> mask;
    if (!fields || (flags & kRouteUp) == 0 || (target.s_addr & mask) != destination) continue;
    route.rejects = (flags & kRouteReject) != 0 || route.interface == "*";  // * = no interface: blackhole
    const std::tuple rank{std::popcount(mask), -metric};
    if (best && rank <= best_rank) continue;
    best = route;
    best_rank = rank;
  }
  return best;
}

}  // namespace airworthy::doctor

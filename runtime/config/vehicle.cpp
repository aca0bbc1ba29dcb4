#include "runtime/config/vehicle.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "runtime/config/multirotor_table.h"

namespace airworthy::rt {

bool VehicleFile::is_valid_name(std::string_view name) {
  const auto is_allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kMaxNameLength && std::all_of(name.begin(), name.end(), is_allowed);
}

Expected<VehicleFile> VehicleFile::read(ConfigFile file) {
  ConfigTable root = file.root();
  VehicleFile vehicle;
  vehicle.name = root.required<std::string>("name");
  if (!is_valid_name(vehicle.name)) {
    root.fail("name", fmt::format("must be 1 to {} of A-Z a-z 0-9 _ -", kMaxNameLength));
  }
  vehicle.kind = root.choice<VehicleKind>(
      "kind", {{"multirotor", VehicleKind::kMultirotor}, {"fixed_wing", VehicleKind::kFixedWing}});
  vehicle.description = root.optional<std::string>("description", "");
  if (const auto table = root.optional_table("multirotor")) {
    vehicle.multirotor = read_multirotor(*table);
    if (vehicle.kind != VehicleKind::kMultirotor) {
      root.fail("multirotor", "describes a multirotor, but kind is another", {"kind"});
    }
  }
  vehicle.hash = file.hash();
  return file.finish(std::move(vehicle));
}

Expected<VehicleFile> VehicleFile::load(const std::filesystem::path& path) {
  return read(ConfigFile::load(path));
}

VehicleFile VehicleFile::named_by(ConfigTable table, std::string_view key) {
  const auto path = table.required_path(key);
  if (path.empty()) return {};
  auto vehicle = load(path);
  if (!vehicle) {
    table.fail_in_other_file(key, vehicle.error());
    return {};
  }
  table.record(fmt::format("{}.hash", key), vehicle->hash);
  return std::move(*vehicle);
}

}  // namespace airworthy::rt

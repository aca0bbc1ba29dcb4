#include "cli/import/flight_log.h"

#include "runtime/bus/channels.h"

namespace airworthy::importer {
namespace {

// FNV-1a, cut to the 48 bits of a session number, never 0.
std::int64_t session_of(const std::string& name) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : name) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3;
  }
  constexpr std::uint64_t kMask = (std::uint64_t{1} << 48U) - 1;
  return static_cast<std::int64_t>(std::max<std::uint64_t>((hash ^ (hash >> 48U)) & kMask, 1));
}

}  // namespace

rt::Expected<std::unique_ptr<FlightLog>> FlightLog::create(const std::filesystem::path& path,
                                                           const std::string& vehicle) {
  auto writer = rt::LogWriter::create(path.string());
  if (!writer) return tl::unexpected<rt::Error>{writer.error()};
  return std::unique_ptr<FlightLog>{new FlightLog{std::move(*writer), path, vehicle}};
}

FlightLog::FlightLog(std::unique_ptr<rt::LogWriter> writer, const std::filesystem::path& path,
                     const std::string& vehicle)
    : path_{path.string()},
      writer_{std::move(writer)},
      node_{*writer_, clock_, log_, rt::Identity{vehicle, kProducer, session_of(path.stem().string())}},
      publishers_{node_.advertise(channel::kImu),
                  node_.advertise(channel::kEscStatus),
                  node_.advertise(channel::kRotorCommand),
                  node_.advertise(channel::kAttitude),
                  node_.advertise(channel::kAttitudeSetpoint),
                  node_.advertise(channel::kFlightState),
                  node_.advertise(channel::kGroundTruth)} {}

void FlightLog::move_to(TimePoint time) {
  if (!has_time_) start_ = time;
  has_time_ = true;
  clock_.advance_to(time);
}

rt::Expected<LogSummary> FlightLog::commit() {
  const auto truths = writer_->messages().find(node_.full_name(channel::kGroundTruth.info));
  const std::size_t truth_channels = truths == writer_->messages().end() ? 0 : 1;
  if (writer_->messages().size() == truth_channels) {
    return rt::fail_with(path_ + ": not written: nothing in the input became a message");
  }
  if (const auto committed = writer_->commit(); !committed)
    return tl::unexpected<rt::Error>{committed.error()};
  return LogSummary{
      path_, node_.identity().vehicle, to_us(start_), to_us(clock_.now()), writer_->messages(), left_out_};
}

}  // namespace airworthy::importer

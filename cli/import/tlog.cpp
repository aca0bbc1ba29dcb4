#include "cli/import/tlog.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "cli/import/byte_source.h"
#include "cli/import/csv_reader.h"
#include "core/protocol/mavlink/parser.h"
#include "core/protocol/mavlink/tlog.h"
#include "drivers/mavlink/mavlink_receiver.h"

namespace airworthy::importer {
namespace {

namespace fs = std::filesystem;

class LogSink final : public drivers::MessageSink {
 public:
  explicit LogSink(FlightLog& log) : log_{log} {}
  void publish(imu_t& message, TimePoint time) override { log_.publish(message, time); }
  void publish(attitude_t& message, TimePoint time) override { log_.publish(message, time); }
  void publish(attitude_setpoint_t& message, TimePoint time) override { log_.publish(message, time); }
  void publish(flight_state_t& message, TimePoint time) override { log_.publish(message, time); }
  void publish(esc_status_t& message, TimePoint time) override { log_.publish(message, time); }
  void publish(rotor_command_t& message, TimePoint time) override { log_.publish(message, time); }

 private:
  FlightLog& log_;
};

class TlogFeed final : public Feed {
 public:
  TlogFeed(fs::path path, std::string content, const drivers::MavlinkConfig& config, FlightLog& log)
      : path_{std::move(path)},
        content_{std::move(content)},
        reader_{{reinterpret_cast<const std::uint8_t*>(content_.data()), content_.size()}},
        sink_{log},
        receiver_{config, sink_, log.node().counters(), log.node().log()} {}

  rt::Expected<bool> next() override {
    const TimePoint last = time();
    switch (reader_.next(record_)) {
      case mavlink::TlogStatus::kEnd:
        return false;
      case mavlink::TlogStatus::kTruncated:
        return fail("truncated record");
      case mavlink::TlogStatus::kCorrupt:
        return fail("no record of a telemetry log");
      case mavlink::TlogStatus::kRecord:
        break;
    }
    if (time() < last) {
      return fail(
          fmt::format("time goes backward by {:.6f} s: records are out of order", to_seconds(last - time())));
    }
    return parse();
  }

  TimePoint time() const override { return from_us(record_.time_us); }
  std::uint64_t position() const override { return record_.offset; }
  std::uint64_t size() const override { return content_.size(); }

  void publish(FlightLog& log) override {
    log.move_to(time());
    if (frame_) {
      receiver_.on_frame(*frame_, time());
    } else {
      log.leave_out("packets of unknown messages");
    }
  }

 private:
  // A record is one packet, so that what the parser makes of it is all there is to know.
  rt::Expected<bool> parse() {
    const mavlink::ParserCounters before = parser_.counters();
    frame_.reset();
    const auto keep = [this](const mavlink::Frame& frame) { frame_ = frame; };
    parser_.push(record_.packet, keep);
    parser_.flush(keep);
    const mavlink::ParserCounters& after = parser_.counters();
    if (after.crc_errors != before.crc_errors || after.bytes_skipped != before.bytes_skipped) {
      return fail("packet with a wrong checksum");
    }
    return true;
  }

  tl::unexpected<rt::Error> fail(std::string_view what) const {
    return rt::fail_with(fmt::format("{}: byte {}{}: {}", path_.string(), record_.offset,
                                     path_.extension() == ".xz" ? " (decompressed)" : "", what));
  }

  fs::path path_;
  std::string content_;
  mavlink::TlogReader reader_;
  mavlink::TlogRecord record_;
  mavlink::Parser parser_;
  std::optional<mavlink::Frame> frame_;
  LogSink sink_;
  drivers::MavlinkReceiver receiver_;
};

struct FaultWord {
  std::string_view word;
  const char* component;
  const char* fault_kind;
};
constexpr std::array<FaultWord, 10> kFaultWords{{
    {"none", "", kNoFault},
    {"engine", "engine", "thrust_loss"},
    {"elevator", "elevator", "stuck"},
    {"rudder", "rudder", "stuck"},
    {"rudder_left", "rudder", "hardover_left"},
    {"rudder_right", "rudder", "hardover_right"},
    {"left_aileron", "left aileron", "stuck"},
    {"right_aileron", "right aileron", "stuck"},
    {"both_ailerons", "left aileron", "stuck"},
    {"both_ailerons", "right aileron", "stuck"},
}};

rt::Expected<std::vector<Truth>> truth_of_row(const CsvReader& reader, std::size_t fault, std::size_t onset) {
  std::vector<Truth> truths;
  std::string_view rest = reader.text(fault);
  if (rest == "unknown") return truths;
  while (!rest.empty()) {
    const std::string_view word = rest.substr(0, rest.find('+'));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    const std::size_t known = truths.size();
    for (const FaultWord& row : kFaultWords) {
      if (row.word != word) continue;
      Truth truth{row.component, row.fault_kind, {}, {}};
      if (truth.fault_kind != kNoFault) {
        const auto ns = reader.integer(onset);
        if (!ns) return tl::unexpected<rt::Error>{ns.error()};
        truth.time = from_us(*ns / 1000);
      }
      truths.push_back(std::move(truth));
    }
    if (truths.size() == known) return reader.fail_cell(fault, "is not a fault this program knows");
  }
  return truths;
}

}  // namespace

drivers::MavlinkConfig default_mavlink_config() {
  drivers::MavlinkConfig config;
  config.imu_sources = {mavlink::HighresImu::kId, mavlink::RawImu::kId, mavlink::ScaledImu::kId,
                        mavlink::ScaledImu2::kId, mavlink::ScaledImu3::kId};
  config.rotor_of_esc = {1, 2, 3, 4};
  return config;
}

std::string tlog_name(const fs::path& file) {
  fs::path name = file.filename();
  for (const char* suffix : {".xz", ".tlog"}) {
    if (name.extension() == suffix) name = name.stem();
  }
  return name.string();
}

rt::Expected<std::vector<Truth>> read_index(const fs::path& index, const std::string& sequence) {
  auto reader = CsvReader::open(index);
  if (!reader) return tl::unexpected<rt::Error>{reader.error()};
  std::array<std::size_t, 3> columns{};
  const std::array<const char*, 3> names{"sequence", "fault", "fault_onset_ns"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto column = reader->column(names[i]);
    if (!column) return tl::unexpected<rt::Error>{column.error()};
    columns[i] = *column;
  }
  for (;;) {
    const auto more = reader->next();
    if (!more) return tl::unexpected<rt::Error>{more.error()};
    if (!*more) return rt::fail_with(fmt::format("{}: has no row for {}", index.string(), sequence));
    if (reader->text(columns[0]) == sequence) return truth_of_row(*reader, columns[1], columns[2]);
  }
}

rt::Expected<LogSummary> import_tlog(const fs::path& file, const fs::path& log_path,
                                     const drivers::MavlinkConfig& config, std::vector<Truth> truths,
                                     const Progress& progress) {
  auto content = read_all(file);
  if (!content) return tl::unexpected<rt::Error>{content.error()};
  auto log = FlightLog::create(log_path, config.vehicle);
  if (!log) return tl::unexpected<rt::Error>{log.error()};
  std::vector<std::unique_ptr<Feed>> feeds;
  feeds.push_back(std::make_unique<TlogFeed>(file, std::move(*content), config, **log));
  if (const auto merged = merge(feeds, std::move(truths), **log, progress); !merged) {
    return tl::unexpected<rt::Error>{merged.error()};
  }
  return (*log)->commit();
}

}  // namespace airworthy::importer

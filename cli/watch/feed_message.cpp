#include "cli/watch/feed_message.h"

#include <fmt/format.h>

#include <cstddef>
#include <limits>
#include <optional>

#include "core/text/utf8.h"

namespace airworthy::watch {
namespace {

using nlohmann::json;

/// A vehicle's health has five levels; thousands would only be there to exhaust a reader.
constexpr int kDeepestNesting = 32;

std::optional<std::int64_t> integer(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_integer()) return std::nullopt;
  if (found->is_number_unsigned() &&
      found->get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
    return std::nullopt;
  }
  return found->get<std::int64_t>();
}

std::string text(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string{};
}

}  // namespace

rt::Expected<FeedMessage> parse_message(std::string_view topic, std::string_view sequence,
                                        std::string_view body) {
  bool too_deep = false;
  const auto limit = [&too_deep](int depth, json::parse_event_t, json&) {
    too_deep = too_deep || depth > kDeepestNesting;
    return !too_deep;
  };
  FeedMessage message;
  message.body = json::parse(body, limit, false);
  if (too_deep) return rt::fail_with("nested too deeply");
  if (message.body.is_discarded()) return rt::fail_with("no JSON");
  if (!message.body.is_object()) return rt::fail_with("no JSON object");

  const auto schema = integer(message.body, "schema");
  if (!schema) return rt::fail_with("no schema number: this is no Airworthy feed");
  if (*schema != FeedMessage::kSchema) {
    return rt::fail_with(
        fmt::format("schema {}; this program reads schema {}", *schema, FeedMessage::kSchema));
  }
  const auto session = integer(message.body, "session");
  const auto number = integer(message.body, "sequence");
  if (!session || !number || *number < 0) return rt::fail_with("no session or sequence number");
  message.session = *session;
  message.sequence = *number;
  message.kind = text(message.body, "kind");
  message.vehicle = text(message.body, "vehicle");
  if (sequence != fmt::format("{}", *number)) return rt::fail_with("two sequence numbers that differ");
  if (topic != fmt::format("airworthy/{}/{}", message.vehicle, message.kind)) {
    return rt::fail_with("a topic that does not match its content");
  }
  message.kind = clean_text<std::string>(message.kind, 64);
  message.vehicle = clean_text<std::string>(message.vehicle, 64);
  return message;
}

}  // namespace airworthy::watch

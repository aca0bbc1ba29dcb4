#pragma once

#include <lcm/eventlog.h>
#include <lzma.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/import/feed.h"
#include "tests/runtime/temporary_folder.h"

namespace airworthy::importer {

inline rt::Expected<void> no_progress(double) { return {}; }

inline std::string content_of(const std::filesystem::path& path) {
  std::ifstream file{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{file}, {}};
}

inline std::string xz(const std::string& text) {
  std::string result(lzma_stream_buffer_bound(text.size()), '\0');
  std::size_t size = 0;
  const auto* in = reinterpret_cast<const std::uint8_t*>(text.data());
  auto* out = reinterpret_cast<std::uint8_t*>(result.data());
  if (lzma_easy_buffer_encode(6, LZMA_CHECK_CRC64, nullptr, in, text.size(), out, &size, result.size()) !=
      LZMA_OK) {
    throw std::runtime_error{"lzma_easy_buffer_encode failed"};
  }
  result.resize(size);
  return result;
}

/// Names of everything in a folder, sorted.
inline std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) {
    names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// The messages of one channel, in the order of the log.
template <class Message>
std::vector<Message> read_log(const std::filesystem::path& path, const std::string& channel) {
  std::vector<Message> messages;
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  if (log == nullptr) throw std::runtime_error{"no log " + path.string()};
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    if (channel == std::string_view{event->channel, static_cast<std::size_t>(event->channellen)}) {
      Message message;
      if (message.decode(event->data, 0, event->datalen) != event->datalen) {
        throw std::runtime_error{"not decodable"};
      }
      messages.push_back(message);
    }
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  return messages;
}

/// Channel and time of every event.
inline std::vector<std::pair<std::string, std::int64_t>> order_of(const std::filesystem::path& path) {
  std::vector<std::pair<std::string, std::int64_t>> order;
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  if (log == nullptr) throw std::runtime_error{"no log " + path.string()};
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    order.emplace_back(std::string(event->channel, static_cast<std::size_t>(event->channellen)),
                       event->timestamp);
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  return order;
}

}  // namespace airworthy::importer

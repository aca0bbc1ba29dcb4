#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "airworthy/counter_t.hpp"

namespace airworthy::rt {

/// Named monotonic counts of a process, published in its PROCESS_STATUS. References stay valid.
class Counters {
 public:
  std::int64_t& operator[](const std::string& name) { return values_[name]; }
  void add(const std::string& name, std::int64_t amount = 1) { values_[name] += amount; }
  [[nodiscard]] std::int64_t value(const std::string& name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? 0 : found->second;
  }
  [[nodiscard]] std::vector<counter_t> to_messages() const {
    std::vector<counter_t> messages;
    messages.reserve(values_.size());
    for (const auto& [name, value] : values_) {
      counter_t& message = messages.emplace_back();
      message.name = name;
      message.value = value;
    }
    return messages;
  }

 private:
  std::map<std::string, std::int64_t> values_;
};

}  // namespace airworthy::rt

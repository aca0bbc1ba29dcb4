#include "runtime/config/state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

namespace airworthy::rt::config_detail {
namespace {

constexpr std::uint64_t kFnvOffset = 0xcbf29ce484222325U;
constexpr std::uint64_t kFnvPrime = 0x100000001b3U;

std::uint64_t fnv1a(std::uint64_t hash, std::string_view text) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * kFnvPrime;
  return hash;
}

/// Insertions, deletions and substitutions that turn one word into the other (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

/// The key the author probably meant: one that was asked for, is not written, and differs in a letter or two.
std::optional<std::string> nearest(const std::string& key, const Node& table) {
  constexpr std::size_t kMaxDistance = 2;
  constexpr std::size_t kMaxLength = 64;
  if (key.size() > kMaxLength) return std::nullopt;
  std::optional<std::string> best;
  std::size_t best_distance = std::min(kMaxDistance, key.size() / 2);
  for (const std::string& asked : table.asked) {
    const bool written = std::any_of(table.entries.begin(), table.entries.end(),
                                     [&](const Entry& entry) { return entry.key == asked; });
    if (written) continue;
    const std::size_t distance = edit_distance(key, asked);
    if (distance < best_distance || (distance == best_distance && !best)) {
      best = asked;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace

void State::parse(std::string_view text, const std::vector<std::string>& overrides) {
  root_ = Node{};
  if (const auto error = parse_document(text, root_)) {
    complaints_.push_back({error->position, fmt::format("{}:{}:{}: {}", file_.string(), error->position.line,
                                                        error->position.column, error->reason)});
    return;
  }
  readable_ = true;
  root_.opened = true;
  root_.position = {Position::Origin::kFile, 1, 1};
  for (const std::string& text_of_override : overrides) apply_override(text_of_override);
}

void State::fail_whole(std::string_view reason) {
  complaints_.push_back({Position{}, fmt::format("{}: {}", file_.string(), reason)});
}

void State::fail(Position at, const std::string& path, std::string_view reason) {
  if (!failed_.insert(path).second) return;
  if (at.origin == Position::Origin::kOverride) {
    fail_override(path, reason);
  } else {
    complaints_.push_back(
        {at, fmt::format("{}:{}:{}: {}: {}", file_.string(), at.line, at.column, path, reason)});
  }
}

bool State::has_failed(const std::string& path) const {
  for (auto it = failed_.lower_bound(path); it != failed_.end() && it->starts_with(path); ++it) {
    if (it->size() == path.size() || (*it)[path.size()] == '.' || (*it)[path.size()] == '[') return true;
  }
  return false;
}

void State::fail_override(std::string_view key, std::string_view reason) {
  complaints_.push_back(
      {Position{Position::Origin::kOverride, 1, 1}, fmt::format("--set {}: {}", key, reason)});
}

void State::apply_override(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view key = text.substr(0, std::min(equals, text.size()));
  const auto steps = parse_path(key);
  if (equals == std::string_view::npos || !steps) {
    fail_override(quoted(text), "must be of the form key.path=value");
    return;
  }
  const std::string_view value_text = text.substr(equals + 1);

  const Position here{Position::Origin::kOverride, 1, 1};
  Node* node = &root_;
  std::string path;
  for (const PathStep& step : *steps) {
    if (step.is_index) {
      if (node->kind != Node::Kind::kArray) {
        fail_override(key, fmt::format("{} is not an array but {}", path, kind_with_article(node->kind)));
        return;
      }
      if (step.index >= node->elements.size()) {
        fail_override(key, fmt::format("{} has {} element{}", path, node->elements.size(),
                                       node->elements.size() == 1 ? "" : "s"));
        return;
      }
      node = &node->elements[step.index];
      path = join(path, step.index);
      continue;
    }
    if (node->kind != Node::Kind::kTable) {
      fail_override(key, fmt::format("{} is not a table but {}", path, kind_with_article(node->kind)));
      return;
    }
    Entry* entry = node->find(step.key);
    if (entry == nullptr) {
      entry = &node->entries.emplace_back();
      entry->key = step.key;
      entry->position = here;
    }
    node = &entry->value;
    path = join(path, step.key);
    if (&step == &steps->back()) entry->position = here;
  }
  if (auto value = parse_value(value_text)) {
    *node = std::move(*value);
  } else {
    *node = Node{};
    node->kind = Node::Kind::kString;
    node->text = value_text;
  }
  node->position = here;
}

Position State::position_of(std::string_view path) {
  const auto steps = parse_path(path);
  Position position = root_.position;
  if (!steps) return position;
  Node* node = &root_;
  for (const PathStep& step : *steps) {
    if (step.is_index) {
      if (step.index >= node->elements.size()) break;
      node = &node->elements[step.index];
      position = node->position;
    } else {
      Entry* entry = node->find(step.key);
      if (entry == nullptr) break;
      node = &entry->value;
      const bool inner = &step != &steps->back() && node->kind == Node::Kind::kTable;
      const Position& candidate = inner ? node->position : entry->position;
      if (candidate.line != 0) position = candidate;
    }
  }
  return position;
}

Position State::position_of_table(std::string_view path) {
  const auto steps = parse_path(path);
  Position position = root_.position;
  if (!steps) return position;
  Node* node = &root_;
  for (const PathStep& step : *steps) {
    if (step.is_index) {
      if (step.index >= node->elements.size()) break;
      node = &node->elements[step.index];
    } else {
      Entry* entry = node->find(step.key);
      if (entry == nullptr) break;
      node = &entry->value;
    }
    if (node->position.line != 0) position = node->position;
  }
  return position;
}

std::string State::hash() const {
  std::uint64_t hash = kFnvOffset;
  for (const auto& [path, value] : effective_) hash = fnv1a(hash, fmt::format("{}={}\n", path, value));
  return fmt::format("{:016x}", hash);
}

void State::report_unknown(const Node& table, const std::string& path) {
  for (const Entry& entry : table.entries) {
    const std::string entry_path = join(path, entry.key);
    if (!entry.visited) {
      const auto meant = nearest(entry.key, table);
      const Position at = entry.position.line != 0 ? entry.position : entry.value.position;
      fail(at, entry_path, meant ? fmt::format("unknown key, did you mean {}?", *meant) : "unknown key");
    } else if (entry.value.opened) {
      report_unknown(entry.value, entry_path);
    }
    for (std::size_t i = 0; i < entry.value.elements.size(); ++i) {
      const Node& element = entry.value.elements[i];
      if (element.opened) report_unknown(element, join(entry_path, i));
    }
  }
}

std::optional<Error> State::errors() {
  if (readable_) report_unknown(root_, "");
  if (complaints_.empty() && other_files_.empty()) return std::nullopt;
  std::stable_sort(complaints_.begin(), complaints_.end(), [](const Complaint& a, const Complaint& b) {
    return std::tuple{a.at.origin, a.at.line, a.at.column} < std::tuple{b.at.origin, b.at.line, b.at.column};
  });
  std::string text;
  const auto append = [&text](const std::string& line) {
    if (!text.empty()) text += '\n';
    text += line;
  };
  for (const Complaint& complaint : complaints_) append(complaint.text);
  for (const std::string& other : other_files_) append(other);
  return Error{std::move(text)};
}

}  // namespace airworthy::rt::config_detail

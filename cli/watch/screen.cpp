#include "cli/watch/screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/text/utf8.h"

namespace airworthy::watch {
namespace {

constexpr std::string_view kRed = "\x1b[1;31m";
constexpr std::string_view kYellow = "\x1b[33m";
constexpr std::string_view kGreen = "\x1b[32m";
constexpr std::string_view kGrey = "\x1b[90m";
constexpr std::string_view kBold = "\x1b[1m";
constexpr std::string_view kPlain = "\x1b[0m";

std::string_view colour_of(std::string_view state) {
  for (const std::string_view bad : {"failed", "warning", "missing", "down"}) {
    if (state == bad) return kRed;
  }
  for (const std::string_view poor : {"degraded", "caution", "advisory", "silent", "never_seen"}) {
    if (state == poor) return kYellow;
  }
  for (const std::string_view good : {"ok", "running"}) {
    if (state == good) return kGreen;
  }
  return kGrey;
}

std::size_t characters(std::string_view text) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < text.size(); i += std::max<std::size_t>(utf8_length(text, i), 1)) ++count;
  return count;
}

std::string cut(std::string_view text, std::size_t most) {
  std::size_t end = 0;
  for (std::size_t count = 0; end < text.size() && count < most; ++count) {
    end += std::max<std::size_t>(utf8_length(text, end), 1);
  }
  return std::string{text.substr(0, end)};
}

std::string padded(std::string text, std::size_t width) {
  const std::size_t count = characters(text);
  if (count < width) text.append(width - count, ' ');
  return text;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// Collects lines, cuts them to the width, and colours their beginning once it is cut.
class Lines {
 public:
  Lines(std::size_t columns, bool colour) : columns_{columns}, colour_{colour} {}

  void add(std::string_view plain) { lines_.push_back(cut(plain, columns_)); }
  void add(std::string_view code, std::string_view coloured, std::string_view rest) {
    const std::string head = cut(coloured, columns_);
    const std::string tail = cut(rest, columns_ - characters(head));
    lines_.push_back(colour_ ? fmt::format("{}{}{}{}", code, head, kPlain, tail) : head + tail);
  }
  void heading(const std::string& text) {
    lines_.emplace_back();
    add(kBold, text, "");
  }
  std::vector<std::string> take(std::size_t rows) {
    if (lines_.size() > rows && rows > 0) {
      const std::size_t hidden = lines_.size() - rows + 1;
      lines_.resize(rows - 1);
      add(fmt::format("... {} more lines", hidden));
    }
    return std::move(lines_);
  }

 private:
  std::size_t columns_;
  bool colour_;
  std::vector<std::string> lines_;
};

std::string for_how_long(const Since& since) {
  return since.age_us ? "for " + duration_text(*since.age_us) : std::string{};
}

template <class Item, class Name>
std::size_t width_of(const std::vector<Item>& items, Name name) {
  constexpr std::size_t kWidest = 32;
  std::size_t width = 0;
  for (const Item& item : items) width = std::max(width, characters(name(item)));
  return std::min(width, kWidest) + 2;
}

constexpr std::size_t kStatusWidth = 12;
constexpr std::size_t kSinceWidth = 16;

/// "  STATUS      name      for 3 s         detail"
void add_row(Lines& lines, const std::string& status, const std::string& name, std::size_t name_width,
             const Since& since, const std::string& detail) {
  const bool loud = colour_of(status) != kGreen && colour_of(status) != kGrey;
  lines.add(colour_of(status), "  " + padded(loud ? upper(status) : status, kStatusWidth),
            padded(name, name_width) + padded(for_how_long(since), kSinceWidth) + detail);
}

void add_faults(Lines& lines, const HealthView& health) {
  if (health.faults.empty()) return;
  lines.heading(fmt::format("FAULTS ({})", health.faults.size()));
  const std::size_t width = width_of(health.faults, [](const FaultView& f) { return f.component; });
  const std::string indent(2 + kStatusWidth, ' ');
  for (const FaultView& fault : health.faults) {
    add_row(lines, fault.severity, fault.component, width, fault.since, fault.advice);
    lines.add(indent + fault.fault_kind + (fault.magnitude.empty() ? "" : " " + fault.magnitude) +
              (fault.latched ? ", latched" : "") + ", by " + fault.producer +
              (fault.since.utc.empty() ? "" : ", since " + fault.since.utc));
    if (!fault.summary.empty()) lines.add(indent + fault.summary);
    if (!fault.unconfirmed.empty()) lines.add(kYellow, indent + "unconfirmed: " + fault.unconfirmed, "");
  }
}

void add_components(Lines& lines, const HealthView& health) {
  lines.heading(fmt::format("COMPONENTS ({})", health.components.size()));
  const std::size_t width = width_of(health.components, [](const ComponentView& c) { return c.name; });
  for (const ComponentView& component : health.components) {
    const std::string first = component.reasons.empty() ? "" : component.reasons.front();
    add_row(lines, component.status, component.name, width, component.since, first);
    for (std::size_t i = 1; i < component.reasons.size(); ++i) {
      lines.add(std::string(2 + kStatusWidth + width + kSinceWidth, ' ') + component.reasons[i]);
    }
  }
  if (health.components.empty()) lines.add("  none: no detector has reported");
}

/// The rates of a link, as many to a line as fit.
void add_rates(Lines& lines, const LinkView& link) {
  constexpr std::size_t kLine = 76;
  const std::string indent(4, ' ');
  std::string line;
  for (const std::string& rate : link.rates) {
    if (!line.empty() && indent.size() + line.size() + 2 + rate.size() > kLine) {
      lines.add(kGrey, indent + line, "");
      line.clear();
    }
    line += (line.empty() ? "" : ", ") + rate;
  }
  if (!line.empty()) lines.add(kGrey, indent + line, "");
}

void add_processes_and_links(Lines& lines, const HealthView& health) {
  lines.heading(fmt::format("PROCESSES ({})", health.processes.size()));
  const std::size_t width = width_of(health.processes, [](const ProcessView& p) { return p.name; });
  for (const ProcessView& process : health.processes) {
    std::string detail = process.detail;
    if (process.restarts > 0) {
      detail += (detail.empty() ? "" : ", ") + fmt::format("restarted {} times", process.restarts);
    }
    add_row(lines, process.status, process.name, width, process.since, detail);
  }
  lines.heading(fmt::format("LINKS ({})", health.links.size()));
  const std::size_t link_width = width_of(health.links, [](const LinkView& l) { return l.name; });
  for (const LinkView& link : health.links) {
    const std::string detail = link.driver + (link.detail.empty() ? "" : ": " + link.detail);
    add_row(lines, link.status, link.name, link_width, link.since, detail);
    add_rates(lines, link);
  }
}

void add_feed(Lines& lines, const FeedState& feed) {
  std::string text = fmt::format("{}   {} messages, {} lost", feed.endpoint, feed.messages, feed.lost);
  if (feed.gateway_restarts > 0) text += fmt::format(", gateway restarted {} times", feed.gateway_restarts);
  lines.add(kGrey, text, "");
  if (feed.refused > 0)
    lines.add(kYellow, fmt::format("{} messages refused: {}", feed.refused, feed.refusal), "");
}

}  // namespace

std::string duration_text(std::int64_t duration_us) {
  const std::int64_t s = duration_us / 1'000'000;
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3'600) return fmt::format("{} min {} s", s / 60, s % 60);
  if (s < 86'400) return fmt::format("{} h {} min", s / 3'600, s / 60 % 60);
  return fmt::format("{} d {} h", s / 86'400, s / 3'600 % 24);
}

std::string silence_text(const FeedState& feed) {
  return fmt::format("no data from {} for {:.0f} s", feed.endpoint, feed.silent_s.value_or(0.0));
}

std::vector<std::string> screen(const std::optional<HealthView>& health, const FeedState& feed,
                                std::size_t columns, std::size_t rows, bool colour) {
  Lines lines{columns, colour};
  if (feed.silent_s) {
    lines.add(kRed, silence_text(feed), health ? "; what follows is old" : "");
    if (!health) lines.add("Does airworthy-gateway run, and is this its feed.endpoint?");
  }
  if (!health) {
    if (!feed.silent_s) lines.add("waiting for " + feed.endpoint);
    add_feed(lines, feed);
    return lines.take(rows);
  }
  std::string phase = health->flight_phase;
  std::replace(phase.begin(), phase.end(), '_', ' ');
  const bool has_phase = !phase.empty() && phase != "unknown";
  // An old status must not look like a present one.
  const std::string_view code = feed.silent_s ? kGrey : colour_of(health->status);
  lines.add(code, fmt::format("{}  {}", health->vehicle, upper(health->status)),
            (has_phase ? "  " + phase : "") +
                (health->root_cause.empty() ? "" : "  root cause: " + health->root_cause) +
                (health->advice.empty() ? "" : "  " + health->advice));
  lines.add(kGrey, health->utc, "");
  add_feed(lines, feed);
  add_faults(lines, *health);
  add_components(lines, *health);
  add_processes_and_links(lines, *health);
  return lines.take(rows);
}

}  // namespace airworthy::watch
